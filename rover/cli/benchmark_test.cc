// rover benchmark, mostly with a program that only pretends to be rover: what is run, what is not
// run again, and what becomes of failures.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rover/cli/benchmark_runner.h"
#include "rover/cli/child_process.h"
#include "rover/cli/program.h"
#include "rover/datasets/test_folder.h"

namespace rover {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

// Notes its subcommand, and leaves what rover would: an ATE of a hundredth of the seed. Family orb
// is refused, superpoint crashes.
constexpr const char* kPretender = R"(#!/bin/sh
echo "$*" >> "$(dirname "$0")/calls"
command=$1
while [ $# -gt 0 ]; do
  case $1 in
    --output|--run) folder=$2 ;;
    --seed) seed=$2 ;;
    --config) config=$2 ;;
  esac
  shift
done
case $command in
  simulate) mkdir "$folder" ;;
  run)
    if grep -q orb "$config"; then echo "rover: no orbs today, sorry" >&2; exit 2; fi
    if grep -q superpoint "$config"; then kill -SEGV $$; fi
    echo "{\"coverage\": 0.5, \"frame_ms\": {\"median\": 10}, \"seed\": $seed}" > "$folder/summary.json" ;;
  evaluate)
    seed=$(sed 's/.*"seed": \([0-9]*\).*/\1/' "$folder/summary.json")
    echo "{\"headline\": \"se3\", \"trajectories\": {\"final\": {\"se3\": {\"ate_m\": {\"rmse\": 0.0$seed}}},
          \"peer\": {\"se3\": {\"ate_m\": {\"rmse\": 0.07}}}}}" > "$folder/evaluation.json" ;;
esac
)";

class BenchmarkTest : public ::testing::Test {
 protected:
  BenchmarkTest() {
    fs::create_directories(folder_ / "data");
    folder_.write("rover", kPretender);
    fs::permissions(folder_ / "rover", fs::perms::owner_all);
  }

  std::vector<BenchmarkRun> run(const std::string& plan, int jobs = 1, bool any_build = false) {
    folder_.write("plan.yaml", plan);
    folder_.write("calls", "");
    BenchmarkOptions options{folder_ / "out", folder_ / "rover", jobs, only_, any_build};
    const BenchmarkPlan read = read_benchmark_plan(folder_ / "plan.yaml");
    testing::internal::CaptureStderr();
    auto runs = BenchmarkRunner(read, options).execute();
    progress_ = testing::internal::GetCapturedStderr();
    return runs;
  }

  // How often the pretender was asked for a subcommand in the last run().
  long calls(const std::string& command) const {
    const std::string text = "\n" + folder_.read("calls");
    long count = 0;
    for (auto at = text.find("\n" + command); at != std::string::npos;
         at = text.find("\n" + command, at + 1)) {
      ++count;
    }
    return count;
  }

  TestFolder folder_;
  std::vector<std::string> only_;
  std::string progress_;
};

constexpr const char* kPlan =
    "seeds: [1, 3]\n"
    "repetitions: 2\n"
    "sequences: [{name: a, dataset: data, modes: [mono, stereo]}]\n"
    "configurations: [{name: one}, {name: two, flags: {threads: 2}}]\n";

TEST_F(BenchmarkTest, RunsEveryCombination) {
  const auto runs = run(kPlan);
  EXPECT_THAT(runs, SizeIs(16));
  EXPECT_EQ(calls("run"), 16);
  EXPECT_EQ(calls("evaluate"), 16);
  const auto cells = summarize(runs);
  ASSERT_THAT(cells, SizeIs(4));
  EXPECT_EQ(cells[0].name, (CellName{"a", "mono", "one"}));
  EXPECT_DOUBLE_EQ(cells[0].figures.at("ate_rmse").median, 0.02);
  EXPECT_DOUBLE_EQ(cells[0].figures.at("ate_rmse").worst, 0.03);
  EXPECT_THAT(folder_.read("calls"), HasSubstr("--threads 2"));
  EXPECT_THAT(folder_.read("out/results.txt"), HasSubstr("0.0200 (0.0300)"));
  EXPECT_THAT(progress_, HasSubstr("[16/16] a stereo two, seed 3, run 2: coverage 50.0%"));
}

TEST_F(BenchmarkTest, DoesNotRepeatWhatIsFinished) {
  const auto first = run(kPlan);
  const auto second = run(kPlan);
  EXPECT_EQ(folder_.read("calls"), "");
  ASSERT_EQ(second.size(), first.size());
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_EQ(first[i].figures, second[i].figures);
}

TEST_F(BenchmarkTest, GoesOnWhereItStopped) {
  run(kPlan);
  // As if it had ended within one run, and within another's evaluation.
  fs::remove(folder_ / "out/runs/a/mono/one/seed3.2/run.stamp.json");
  fs::remove(folder_ / "out/runs/a/mono/two/seed1.1/evaluate.stamp.json");
  run(kPlan);
  EXPECT_EQ(calls("run"), 1);
  EXPECT_EQ(calls("evaluate"), 2);
}

TEST_F(BenchmarkTest, RepeatsWhatHasChanged) {
  run(kPlan);
  const std::string changed = std::string(kPlan) + "\n";
  const auto flags =
      std::string(kPlan).replace(std::string(kPlan).find("threads: 2"), 10, "threads: 1");
  run(changed);
  EXPECT_EQ(calls("run"), 0);  // an empty line is no change
  run(flags);
  EXPECT_EQ(calls("run"), 8);
  folder_.write("rover", std::string(kPretender) + "# another build\n");
  run(flags, 1, true);
  EXPECT_EQ(calls("run"), 0);
  run(flags);
  EXPECT_EQ(calls("run"), 16);
}

TEST_F(BenchmarkTest, SurvivesRunsThatFail) {
  const std::string plan =
      "sequences: [{name: a, dataset: data, modes: [mono]}]\n"
      "configurations:\n  - {name: refused, settings: {family: orb}}\n"
      "  - {name: crashes, settings: {family: superpoint}}\n  - {name: fine}\n";
  const auto runs = run(plan);
  ASSERT_THAT(runs, SizeIs(3));
  EXPECT_EQ(runs[0].failure, "no orbs today, sorry");
  EXPECT_EQ(runs[1].failure, "ended by signal 11");
  EXPECT_EQ(runs[2].failure, "");
  EXPECT_THAT(folder_.read("out/results.csv"), HasSubstr("\"no orbs today, sorry\""));
  run(plan);
  EXPECT_EQ(calls("run"), 2);  // a failure is no result
}

TEST_F(BenchmarkTest, SimulatesEachSequenceOncePerSeed) {
  const std::string plan =
      "seeds: [4, 5]\nmodes: [mono, stereo]\n"
      "sequences: [{name: room, simulate: {scene: room, scene-seed: $seed}}]\n";
  run(plan);
  EXPECT_EQ(calls("simulate"), 2);
  EXPECT_EQ(calls("run"), 4);
  const std::string sequence = (fs::absolute(folder_ / "out") / "sequences/room-5").string();
  EXPECT_THAT(folder_.read("calls"), AllOf(HasSubstr("simulate --output " + sequence +
                                                     " --seed 5 --scene room --scene-seed 5"),
                                           HasSubstr("run --dataset " + sequence)));
  run(plan);
  EXPECT_EQ(folder_.read("calls"), "");
  fs::remove_all(folder_ / "out/sequences/room-4");
  run(plan);
  EXPECT_EQ(calls("simulate"), 1);
}

TEST_F(BenchmarkTest, DoesAPartOfAPlan) {
  const std::string plan =
      "modes: [mono, stereo]\nsequences:\n  - {name: V1_real, simulate: {scene: room}}\n"
      "  - {name: V2_real, simulate: {scene: room}}\n  - {name: V2_dim, dataset: data}\n";
  const auto cells = [&](const std::vector<std::string>& only) {
    only_ = only;
    std::vector<std::string> names;
    for (const BenchmarkRun& run : run(plan))
      names.push_back(run.cell.sequence + " " + run.cell.mode);
    return names;
  };
  EXPECT_THAT(cells({"V1_real"}), ElementsAre("V1_real mono", "V1_real stereo"));
  EXPECT_EQ(calls("simulate"), 1);
  EXPECT_THAT(cells({"V2*/mono*"}), ElementsAre("V2_real mono", "V2_dim mono"));
  EXPECT_THAT(cells({"*m"}), ElementsAre("V2_dim mono", "V2_dim stereo"));
  EXPECT_THAT(cells({"V1_real/mono", "dim/stereo"}), ElementsAre("V1_real mono", "V2_dim stereo"));
  const BenchmarkPlan read = read_benchmark_plan(folder_ / "plan.yaml");
  const BenchmarkOptions none{folder_ / "out", folder_ / "rover", 1, {"V3"}, false};
  EXPECT_THAT(input_error_of([&] { BenchmarkRunner(read, none).execute(); }), HasSubstr("--only"));
}

TEST_F(BenchmarkTest, ComparesWithOtherPrograms) {
  folder_.write("peer.txt", "1 0 0 0 0 0 0 1\n");
  const std::string plan =
      "sequences: [{name: a, dataset: data, modes: [mono]}]\n"
      "others: [{name: peer, sequence: a, mode: mono, trajectory: peer.txt}]\n";
  const auto runs = run(plan);
  ASSERT_THAT(runs, SizeIs(2));
  EXPECT_EQ(runs[1].cell.configuration, "peer");
  EXPECT_EQ(runs[1].figures.at("ate_rmse"), 0.07);
  folder_.write("peer.txt", "2 0 0 0 0 0 0 1\n");
  run(plan);
  EXPECT_EQ(calls("run"), 0);
  EXPECT_EQ(calls("evaluate"), 1);
}

TEST_F(BenchmarkTest, RunsSeveralAtATime) {
  const auto runs = run(kPlan, 3);
  EXPECT_THAT(runs, SizeIs(16));
  EXPECT_TRUE(std::all_of(runs.begin(), runs.end(),
                          [](const BenchmarkRun& r) { return r.figures.contains("ate_rmse"); }));
}

TEST_F(BenchmarkTest, NamesWhatIsWrongWithSettings) {
  folder_.write("plan.yaml",
                "sequences: [{name: a, dataset: data, modes: [mono]}]\n"
                "configurations:\n  - name: wrong\n    settings: {features: many}\n");
  const BenchmarkPlan plan = read_benchmark_plan(folder_ / "plan.yaml");
  const BenchmarkOptions options{folder_ / "out", folder_ / "rover", 1, {}, false};
  EXPECT_THAT(input_error_of([&] { BenchmarkRunner(plan, options); }),
              AllOf(HasSubstr("plan.yaml:4: configuration wrong"), HasSubstr("'features'")));
  const BenchmarkOptions nowhere{folder_ / "plan.yaml/out", folder_ / "rover", 1, {}, false};
  EXPECT_THAT(input_error_of([&] { BenchmarkRunner(plan, nowhere); }), HasSubstr("--output"));
  const BenchmarkOptions none{folder_ / "out", folder_ / "no", 1, {}, false};
  EXPECT_THAT(input_error_of([&] { BenchmarkRunner(plan, none); }), HasSubstr("--program"));
}

TEST(ChildProcess, TellsHowItEnded) {
  const TestFolder folder;
  const fs::path log = folder / "log";
  EXPECT_TRUE(run_child("/bin/sh", {"-c", "echo out; echo err >&2"}, log).ok());
  EXPECT_EQ(folder.read("log"), "out\nerr\n");
  EXPECT_EQ(run_child("/bin/sh", {"-c", "exit 3"}, log).status, 3);
  EXPECT_EQ(run_child("/bin/sh", {"-c", "kill -KILL $$"}, log).status, 128 + 9);
  EXPECT_EQ(run_child("/no/such/program", {}, log).status, 127);
}

// The whole of it with the real program on a few real frames.
TEST(Benchmark, ComparesFamiliesOnAFlight) {
  const fs::path rover = fs::path(ROVER_BINARY_DIR) / "rover";
  const fs::path clip = shared_folder() / "data/euroc/V1_01_clip";
  if (!fs::exists(rover)) GTEST_SKIP() << rover << " is not built";
  if (!fs::exists(clip)) GTEST_SKIP() << clip << " is not here";
  const TestFolder folder;
  folder.write("plan.yaml",
               fmt::format("sequences: [{{name: clip, dataset: {}, modes: [mono], "
                           "max-frames: 30}}]\n"
                           "configurations: [{{name: orb, settings: {{family: orb}}}}]\n",
                           fs::absolute(clip).string()));
  const std::string plan = (folder / "plan.yaml").string(), out = (folder / "out").string();
  const std::string program = rover.string();
  const char* argv[] = {"rover",     "benchmark", plan.c_str(),   "--output",
                        out.c_str(), "--program", program.c_str()};
  testing::internal::CaptureStdout();
  EXPECT_EQ(run_program(7, argv), 0);
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("coverage [%]"));
  const auto results = nlohmann::json::parse(folder.read("out/results.json"));
  const auto& figures = results["runs"][0]["figures"];
  EXPECT_EQ(results["runs"][0]["failure"], "");
  EXPECT_GT(figures["frame_median"].get<double>(), 0);
  EXPECT_TRUE(figures.contains("coverage"));
  EXPECT_THAT(folder.read("out/index.html"), AllOf(HasSubstr("clip"), HasSubstr("orb")));
}

}  // namespace
}  // namespace rover
