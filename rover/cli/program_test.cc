#include "rover/cli/test_program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rover/datasets/test_folder.h"
#include "rover/datasets/trajectory.h"

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Outcome call(const std::vector<std::string>& arguments) { return call_program(arguments); }

void expect_user_error(const Outcome& outcome, const std::string& part) {
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.err, AllOf(StartsWith("rover: "), HasSubstr(part)));
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
}

// A winding path of 50 poses, one per second, in TUM format.
std::string path_of(double scale) {
  std::string text;
  for (int i = 0; i < 50; ++i) {
    text += fmt::format("{}.0 {} {} {} 0 0 0 1\n", i + 1, scale * std::cos(0.2 * i),
                        scale * std::sin(0.3 * i), 0.1 * scale * i);
  }
  return text;
}

TEST(Program, TellsVersionAndHelp) {
  const auto version = call({"--version"});
  EXPECT_EQ(version.status, 0);
  EXPECT_EQ(version.out, "rover " ROVER_VERSION "\n");
  const auto help = call({"--help"});
  EXPECT_EQ(help.status, 0);
  EXPECT_THAT(help.out, AllOf(HasSubstr("run"), HasSubstr("evaluate"), HasSubstr("match")));
}

TEST(Program, RefusesWhatItDoesNotKnowInOneLine) {
  expect_user_error(call({}), "subcommand");
  expect_user_error(call({"fly"}), "fly");
  expect_user_error(call({"evaluate", "--fast"}), "--fast");
  expect_user_error(call({"benchmark"}), "FILE");
  expect_user_error(call({"benchmark", "/nothing.yaml"}), "/nothing.yaml");
  expect_user_error(call({"match", "a.png", "b.png"}), "--output");
  expect_user_error(call({"match", "a.png", "b.png", "--output", "c.jpg"}), ".png");
}

TEST(Evaluate, AsksForOnePairOfInputs) {
  expect_user_error(call({"evaluate"}), "--run DIR");
  expect_user_error(call({"evaluate", "--run", "a"}), "--dataset");
  expect_user_error(call({"evaluate", "--run", "a", "--dataset", "b", "--estimate", "c"}),
                    "--reference");
  expect_user_error(call({"evaluate", "--run", "/nothing", "--dataset", "b"}), "/nothing");
}

TEST(Evaluate, JudgesTwoFiles) {
  const TestFolder folder;
  folder.write("estimate.txt", path_of(1));
  folder.write("reference.txt", path_of(2));
  const std::vector<std::string> arguments = {"evaluate",
                                              "--estimate",
                                              (folder / "estimate.txt").string(),
                                              "--reference",
                                              (folder / "reference.txt").string(),
                                              "--output",
                                              folder.path().string()};
  const auto table = call(arguments);
  EXPECT_EQ(table.status, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr("ATE SE(3)"), HasSubstr("ATE Sim(3)")));
  EXPECT_THAT(folder.read("trajectory.svg"), HasSubstr("</svg>"));
  auto with_json = arguments;
  with_json.push_back("--json");
  const auto json = nlohmann::json::parse(call(with_json).out);
  EXPECT_NEAR(json["trajectories"]["estimate"]["sim3"]["scale"].get<double>(), 2, 1e-9);
  EXPECT_EQ(json, nlohmann::json::parse(folder.read("evaluation.json")));
}

class EvaluateRun : public ::testing::Test {
 protected:
  EvaluateRun() {
    folder_.write("run/summary.json", R"({"mode": "mono", "pose_frame": "cam0"})");
    folder_.write("run/trajectory_final.txt", path_of(1));
    folder_.write("run/trajectory_causal.txt", path_of(1.5));
    folder_.write("run/frames.csv", "frame,time,state\n0,1.0,ok\n1,60.0,lost\n");
    folder_.write("run/timing.csv", "frame,stage,ms\n0,extract,5\n");
    folder_.write("freiburg1/rgb.txt", "1.0 rgb/1.png\n");
    folder_.write_image("freiburg1/rgb/1.png", 640, 480);
    folder_.write("freiburg1/groundtruth.txt", path_of(2));
  }

  Outcome evaluate(std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {"evaluate", "--run", (folder_ / "run").string(),
                                          "--dataset", (folder_ / "freiburg1").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return call(arguments);
  }

  TestFolder folder_;
};

TEST_F(EvaluateRun, JudgesAgainstTheDatasetAndPeers) {
  const auto outcome =
      evaluate({"--peer", "other=" + (folder_ / "run/trajectory_final.txt").string()});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("final"), HasSubstr("causal"), HasSubstr("other"),
                                 HasSubstr("ATE Sim(3)"), HasSubstr("extract")));
  const auto json = nlohmann::json::parse(folder_.read("run/evaluation.json"));
  EXPECT_EQ(json["headline"], "sim3");
  EXPECT_NEAR(json["trajectories"]["final"]["sim3"]["scale"].get<double>(), 2, 1e-9);
  EXPECT_NEAR(json["trajectories"]["final"]["longest_gap_s"].get<double>(), 10, 1e-9);
  EXPECT_EQ(json["trajectories"]["other"], json["trajectories"]["final"]);
  EXPECT_EQ(json["states"]["lost"], 1);
  EXPECT_THAT(folder_.read("run/trajectory.svg"), HasSubstr("</svg>"));
  EXPECT_THAT(folder_.read("run/report.html"),
              AllOf(HasSubstr("freiburg1"), HasSubstr("ATE Sim(3)"), HasSubstr("</html>")));
  EXPECT_EQ(read_tum_trajectory(folder_ / "run/trajectory_aligned.txt").size(), 50u);
}

TEST_F(EvaluateRun, CutsPeersToTheTimeOfTheRun) {
  folder_.write("run/frames.csv", "frame,time,state\n0,11.0,ok\n1,30.0,ok\n");
  const auto outcome =
      evaluate({"--peer", "other=" + (folder_ / "run/trajectory_final.txt").string()});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(folder_.read("run/evaluation.json"));
  EXPECT_EQ(json["trajectories"]["other"]["poses"], 20);
}

TEST_F(EvaluateRun, ReportsRunsWithoutGroundTruth) {
  const auto outcome = call({"evaluate", "--run", (folder_ / "run").string(), "--report"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("extract"), HasSubstr("report.html")));
  EXPECT_THAT(folder_.read("run/report.html"), HasSubstr("no ground truth"));
}

TEST_F(EvaluateRun, SaysWhatIsWrong) {
  expect_user_error(evaluate({"--peer", "nonsense"}), "NAME=FILE");
  expect_user_error(evaluate({"--format", "bag"}), "bag");
  std::filesystem::remove(folder_ / "freiburg1/groundtruth.txt");
  expect_user_error(evaluate(), "no ground truth");
  std::filesystem::remove(folder_ / "run/summary.json");
  expect_user_error(evaluate(), "summary.json");
}

}  // namespace
}  // namespace rover
