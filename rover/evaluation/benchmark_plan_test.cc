#include "rover/evaluation/benchmark_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/datasets/test_folder.h"

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class BenchmarkPlanTest : public ::testing::Test {
 protected:
  BenchmarkPlanTest() { folder_.write("data/rgb.txt", ""); }

  BenchmarkPlan read(const std::string& text) const {
    folder_.write("plan.yaml", text);
    return read_benchmark_plan(folder_ / "plan.yaml");
  }
  std::string error_of(const std::string& text) const {
    return input_error_of([&] { read(text); });
  }

  TestFolder folder_;
};

TEST_F(BenchmarkPlanTest, HoldsWhatTheFileSays) {
  folder_.write("other.txt", "");
  const BenchmarkPlan plan = read(R"(
output: results
repetitions: 5
seeds: [1, 2]
modes: [mono]
sequences:
  - {name: desk, dataset: data, modes: [mono, stereo], max-frames: 20, format: tum}
  - name: room
    seeds: [7]
    simulate: {scene: room, lighting: dim, textures: data, fast: true, slow: false, variant: $seed}
configurations:
  - {name: default}
  - name: quick
    settings: {family: orb, keyframe: {min_gap: 2}}
    flags: {realtime: true, threads: 2}
others:
  - {name: peer, sequence: desk, mode: stereo, trajectory: other.txt}
)");
  EXPECT_EQ(plan.output, folder_ / "results");
  EXPECT_EQ(plan.repetitions, 5);
  ASSERT_THAT(plan.sequences, SizeIs(2));
  const BenchmarkSequence& desk = plan.sequences[0];
  EXPECT_EQ(desk.dataset, folder_ / "data");
  EXPECT_THAT(desk.modes, ElementsAre("mono", "stereo"));
  EXPECT_THAT(desk.seeds, ElementsAre(1u, 2u));
  EXPECT_THAT(to_arguments(desk.input), ElementsAre("--format", "tum"));
  EXPECT_THAT(to_arguments(desk.run), ElementsAre("--max-frames", "20"));
  const BenchmarkSequence& room = plan.sequences[1];
  EXPECT_THAT(room.modes, ElementsAre("mono"));
  EXPECT_THAT(room.seeds, ElementsAre(7u));
  EXPECT_THAT(to_arguments(*room.simulate),
              ElementsAre("--scene", "room", "--lighting", "dim", "--textures",
                          (folder_ / "data").string(), "--fast", "--variant", "$seed"));
  ASSERT_THAT(plan.configurations, SizeIs(2));
  EXPECT_THAT(plan.configurations[0].settings, IsEmpty());
  EXPECT_THAT(plan.configurations[1].settings, AllOf(HasSubstr("family"), HasSubstr("min_gap")));
  EXPECT_THAT(to_arguments(plan.configurations[1].flags),
              ElementsAre("--realtime", "--threads", "2"));
  ASSERT_THAT(plan.others, SizeIs(1));
  EXPECT_EQ(plan.others[0].trajectory, folder_ / "other.txt");
}

TEST_F(BenchmarkPlanTest, HasOneConfigurationIfNoneIsGiven) {
  const BenchmarkPlan plan = read("sequences: [{name: a, dataset: data, modes: [mono]}]\n");
  ASSERT_THAT(plan.configurations, SizeIs(1));
  EXPECT_EQ(plan.configurations[0].name, "default");
  EXPECT_EQ(plan.repetitions, 1);
}

TEST_F(BenchmarkPlanTest, NamesFileAndLineOfMistakes) {
  const std::string begin = "sequences:\n  - {name: a, dataset: data, modes: [mono]}\n";
  EXPECT_THAT(error_of(begin + "repetition: 2\n"), HasSubstr("plan.yaml:3: unknown key"));
  EXPECT_THAT(error_of(begin + "repetitions: 0\n"), HasSubstr("plan.yaml:3: repetitions"));
  EXPECT_THAT(error_of(begin + "seeds: []\n"), HasSubstr("plan.yaml:3: seeds"));
  EXPECT_THAT(error_of(begin + "seeds: [one]\n"), HasSubstr("plan.yaml:3: a seed"));
  EXPECT_THAT(error_of(begin + "modes: [sideways]\n"), HasSubstr("'sideways'"));
  EXPECT_THAT(error_of(begin + "  - {name: a, dataset: data, modes: [mono]}\n"),
              HasSubstr("plan.yaml:3: the name 'a' is given twice"));
  EXPECT_THAT(error_of(begin + "  - {name: b, dataset: nowhere, modes: [mono]}\n"),
              AllOf(HasSubstr("plan.yaml:3"), HasSubstr("nowhere is not there")));
  EXPECT_THAT(error_of(begin + "  - {name: b, modes: [mono]}\n"), HasSubstr("'simulate'"));
  EXPECT_THAT(error_of(begin + "  - {name: b, dataset: data}\n"), HasSubstr("needs 'modes'"));
  EXPECT_THAT(error_of(begin + "  - {name: ../b, dataset: data}\n"), HasSubstr("'../b'"));
  EXPECT_THAT(error_of("sequences:\n  - {name: b, modes: [mono], simulate: {output: x}}\n"),
              HasSubstr("simulate.output"));
}

TEST_F(BenchmarkPlanTest, RefusesConfigurationsAndOthersThatMakeNoSense) {
  const std::string begin = "sequences: [{name: a, dataset: data, modes: [mono]}]\n";
  EXPECT_THAT(error_of(begin + "configurations: [{settings: {family: orb}}]\n"),
              HasSubstr("plan.yaml:2: a configuration needs a name"));
  EXPECT_THAT(error_of(begin + "configurations: [{name: x, flags: {output: y}}]\n"),
              HasSubstr("unknown key 'output' in flags"));
  EXPECT_THAT(error_of(begin + "configurations: [{name: x, settings: orb}]\n"),
              HasSubstr("settings must be"));
  folder_.write("t.txt", "");
  const std::string other = begin + "others:\n  - {name: p, sequence: ";
  EXPECT_THAT(error_of(other + "b, mode: mono, trajectory: t.txt}\n"),
              HasSubstr("no sequence 'b'"));
  EXPECT_THAT(error_of(other + "a, mode: stereo, trajectory: t.txt}\n"), HasSubstr("'stereo'"));
  EXPECT_THAT(error_of(other + "a, mode: mono, trajectory: u.txt}\n"), HasSubstr("is not there"));
  EXPECT_THAT(error_of(begin + "others:\n  - {name: default, sequence: a, mode: mono, "
                               "trajectory: t.txt}\n"),
              HasSubstr("'default' is taken"));
}

TEST_F(BenchmarkPlanTest, RefusesWhatIsNoPlan) {
  EXPECT_THAT(error_of(""), HasSubstr("plan.yaml"));
  EXPECT_THAT(error_of("- a\n"), HasSubstr("holds no keys"));
  EXPECT_THAT(error_of("modes: [mono]\n"), HasSubstr("'sequences' is missing"));
  EXPECT_THAT(error_of("modes: [mono\nsequences: 3\n"), HasSubstr("not valid YAML"));
  EXPECT_THAT(input_error_of([&] { read_benchmark_plan(folder_ / "no.yaml"); }),
              HasSubstr("no.yaml"));
}

// The plans that come with the source are read as they are; simulated flights may need data.
TEST(BenchmarkPlan, ExamplesAreValid) {
  const std::filesystem::path folder = std::filesystem::path(ROVER_SOURCE_DIR) / "bench";
  if (!std::filesystem::exists(shared_folder() / "data")) {
    GTEST_SKIP() << (shared_folder() / "data") << " is not here";
  }
  int plans = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".yaml") continue;
    EXPECT_NO_THROW(read_benchmark_plan(entry.path())) << entry.path();
    ++plans;
  }
  EXPECT_GE(plans, 5);
}

}  // namespace
}  // namespace rover
