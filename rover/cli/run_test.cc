// `rover run` from end to end, on short pieces of real sequences and on input that is broken.
#include <algorithm>
#include <cstdlib>
#include <map>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rover/cli/finished_run.h"
#include "rover/datasets/dataset.h"
#include "rover/datasets/test_sequences.h"
#include "rover/evaluation/judgement.h"
#include "rover/evaluation/run_folder.h"
#include "rover/networks/runtime.h"

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

void expect_contract(const FinishedRun& run) {
  for (const char* name :
       {"trajectory_causal.txt", "trajectory_odometry.txt", "trajectory_final.txt", "keyframes.txt",
        "frames.csv", "timing.csv", "covariance.csv", "map.ply"}) {
    const std::string text = run.read(name);
    EXPECT_GT(std::count(text.begin(), text.end(), '\n'), 2) << name;
  }
  const auto summary = run.summary();
  for (const char* key : {"mode",
                          "pose_frame",
                          "frames",
                          "frames_tracked",
                          "coverage",
                          "keyframes",
                          "landmarks",
                          "maps",
                          "lost_events",
                          "loops_closed",
                          "stages",
                          "frame_ms",
                          "dropped_frames",
                          "mapping_lag_frames",
                          "realtime_factor",
                          "peak_rss_mb",
                          "threads",
                          "seed",
                          "version",
                          "families"}) {
    EXPECT_TRUE(summary.contains(key)) << key;
  }
  for (const char* key : {"median", "p95", "p99", "max"}) {
    EXPECT_GT(summary["frame_ms"][key].get<double>(), 0) << key;
  }
  for (const auto& [stage, ms] : summary["stages"].items()) {
    EXPECT_LE(ms["median"].get<double>(), ms["max"].get<double>()) << stage;
  }
  EXPECT_THAT(run.read("map.ply"), StartsWith("ply\n"));
  EXPECT_EQ(run.states().size(), summary["frames"].get<std::size_t>());
}

// metres: what two poses of consecutive frames may be wrong by, once the whole is aligned.
void expect_smooth_odometry(const FinishedRun& run, double bound) {
  const Judgement odometry = run.judge_file("trajectory_odometry.txt");
  ASSERT_TRUE(odometry.similarity.has_value());
  EXPECT_GT(odometry.similarity->relative_translation.count, 10u);
  EXPECT_LT(odometry.similarity->relative_translation.max, bound);
}

TEST(Run, PlacesEveryFrameOfAFlight) {
  SKIP_UNLESS_PRESENT(kClip);
  const FinishedRun run(sequence_folder(kClip), "mono");
  EXPECT_EQ(run.outcome().err, "");
  expect_contract(run);
  const Judgement final = run.judge_file("trajectory_final.txt");
  EXPECT_GE(final.coverage.value(), 0.95);
  ASSERT_TRUE(final.similarity.has_value());
  EXPECT_LE(final.similarity->position.rmse, 0.0050);
  expect_smooth_odometry(run, 0.02);
  const auto summary = run.summary();
  EXPECT_EQ(summary["mode"], "mono");
  EXPECT_EQ(summary["pose_frame"], "cam0");
  EXPECT_EQ(summary["frames"], 90);
  EXPECT_EQ(summary["maps"], 1);
  EXPECT_EQ(summary["threads"], 2);
  const RunFolder folder = read_run_folder(run.output());
  EXPECT_GE(folder.samples.size(), 3u);
  EXPECT_LE(folder.samples.size(), 8u);
  EXPECT_GT(folder.frames.back().rss_mb, 20);
  EXPECT_FALSE(summary["realtime"].get<bool>());
}

TEST(Run, FollowsAHandAtADesk) {
  SKIP_UNLESS_PRESENT(kDesk);
  const FinishedRun run(sequence_folder(kDesk), "mono", {"--max-frames", "150"});
  expect_contract(run);
  const Judgement final = run.judge_file("trajectory_final.txt");
  EXPECT_GE(final.coverage.value(), 0.95);
  ASSERT_TRUE(final.similarity.has_value());
  EXPECT_LE(final.similarity->position.rmse, 0.0140);
  expect_smooth_odometry(run, 0.05);
}

TEST(Run, DrivesWithTwoCameras) {
  SKIP_UNLESS_PRESENT(kStreet);
  const FinishedRun run(sequence_folder(kStreet), "stereo", {"--max-frames", "60"});
  expect_contract(run);
  const Judgement final = run.judge_file("trajectory_final.txt");
  EXPECT_EQ(final.coverage.value(), 1);
  ASSERT_TRUE(final.rigid.has_value());
  EXPECT_LE(final.rigid->position.rmse, 0.44);
  expect_smooth_odometry(run, 0.3);
}

TEST(Run, DrivesWithOneCamera) {
  SKIP_UNLESS_PRESENT(kStreet);
  const FinishedRun run(sequence_folder(kStreet), "mono", {"--max-frames", "60"});
  expect_contract(run);
  const Judgement final = run.judge_file("trajectory_final.txt");
  EXPECT_GE(final.coverage.value(), 0.95);
  ASSERT_TRUE(final.similarity.has_value());
  EXPECT_LE(final.similarity->position.rmse, 0.25);
}

TEST(Run, GivesTheSameBytesTwice) {
  SKIP_UNLESS_PRESENT(kClip);
  for (const std::string threads : {"1", "2"}) {
    const Arguments options = {"--max-frames", "60", "--threads", threads};
    TestFolder folders[2];
    for (const TestFolder& folder : folders) {
      Arguments arguments = {"--dataset", sequence_folder(kClip).string(), "--mode", "mono",
                             "--output",  folder.path().string()};
      arguments.insert(arguments.end(), options.begin(), options.end());
      ASSERT_EQ(call(arguments).status, 0);
    }
    for (const char* name : {"trajectory_causal.txt", "trajectory_odometry.txt",
                             "trajectory_final.txt", "keyframes.txt", "covariance.csv"}) {
      EXPECT_FALSE(folders[0].read(name).empty()) << name;
      EXPECT_TRUE(folders[0].read(name) == folders[1].read(name))
          << name << " differs with " << threads << " threads";
    }
  }
}

TEST(Run, FinishesInRealTime) {
  SKIP_UNLESS_PRESENT(kClip);
  const FinishedRun run(sequence_folder(kClip), "mono", {"--max-frames", "60", "--realtime"});
  expect_contract(run);
  const auto summary = run.summary();
  EXPECT_TRUE(summary["realtime"].get<bool>());
  EXPECT_EQ(summary["frames"], 60);
  EXPECT_LT(summary["realtime_factor"].get<double>(), 1.05);  // it waits for the input
  const auto states = run.states();
  EXPECT_EQ(std::count(states.begin(), states.end(), "dropped"),
            summary["dropped_frames"].get<int>());
}

TEST(Run, FindsItsWayBackAfterDarkness) {
  SKIP_UNLESS_PRESENT(kClip);
  const FlightPiece piece(90);
  for (std::size_t i = 45; i < 55; ++i) piece.blacken(i);
  const FinishedRun run(piece.path(), "mono");
  const auto states = run.states();
  ASSERT_EQ(states.size(), 90u);
  EXPECT_EQ(std::count(states.begin() + 45, states.begin() + 55, "ok"), 0);
  EXPECT_EQ(states[44], "ok");
  EXPECT_GE(std::count(states.begin() + 60, states.end(), "ok"), 28);
  const auto summary = run.summary();
  EXPECT_EQ(summary["lost_events"], 1);
  EXPECT_EQ(summary["maps"], 1);  // found again, not begun again
  EXPECT_EQ(summary["frames_skipped"], 0);
  expect_contract(run);
}

TEST(Run, PassesOverImagesItCannotUse) {
  SKIP_UNLESS_PRESENT(kClip);
  const FlightPiece piece(50);
  piece.truncate(30, 20000);
  piece.truncate(34, 0);
  piece.shrink(38);
  const FinishedRun run(piece.path(), "mono");
  const auto states = run.states();
  ASSERT_EQ(states.size(), 50u);
  for (const std::size_t bad : {30u, 34u, 38u}) EXPECT_EQ(states[bad], "skipped");
  EXPECT_EQ(std::count(states.begin(), states.end(), "skipped"), 3);
  EXPECT_EQ(std::count(states.begin() + 28, states.end(), "ok"), 19);
  EXPECT_EQ(run.summary()["frames_skipped"], 3);
  EXPECT_EQ(run.summary()["frames"], 50);
  const auto& warnings = run.outcome().err;
  EXPECT_EQ(std::count(warnings.begin(), warnings.end(), '\n'), 3) << warnings;
}

TEST(Run, AFlightInTheDarkIsNoCrash) {
  SKIP_UNLESS_PRESENT(kClip);
  const FlightPiece piece(12);
  for (std::size_t i = 0; i < 12; ++i) piece.blacken(i);
  const FinishedRun run(piece.path(), "mono");
  EXPECT_EQ(run.summary()["coverage"], 0);
  EXPECT_EQ(run.summary()["maps"], 0);
  const auto states = run.states();
  EXPECT_EQ(std::count(states.begin(), states.end(), "waiting"), 12);
  EXPECT_EQ(run.read("trajectory_final.txt").find_first_of("0123456789"), std::string::npos);
  EXPECT_THAT(run.read("map.ply"), HasSubstr("element vertex 0\n"));
}

// Five tiny images: enough to be refused for other reasons.
class RunRefuses : public ::testing::Test {
 protected:
  RunRefuses() { write_euroc(folder_); }

  void expect_refusal(const std::string& part, const Arguments& changed) const {
    std::map<std::string, std::string> options = {{"--dataset", folder_.path().string()},
                                                  {"--mode", "mono"},
                                                  {"--output", (folder_ / "out").string()}};
    for (std::size_t i = 0; i + 1 < changed.size(); i += 2) options[changed[i]] = changed[i + 1];
    Arguments arguments;
    for (const auto& [name, value] : options) arguments.insert(arguments.end(), {name, value});
    const Outcome outcome = call(arguments);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, AllOf(StartsWith("rover: "), HasSubstr(part)));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(fs::exists(folder_ / "out/summary.json"));
  }

  void expect_config_refusal(const std::string& part, const std::string& text) const {
    folder_.write("rover.yaml", text);
    expect_refusal(part, {"--config", (folder_ / "rover.yaml").string()});
  }

  TestFolder folder_;
};

TEST_F(RunRefuses, DatasetsThatAreNone) {
  expect_refusal("/nothing/here", {"--dataset", "/nothing/here"});
  fs::create_directories(folder_ / "empty");
  expect_refusal("empty", {"--dataset", (folder_ / "empty").string()});
  expect_refusal("image_0", {"--format", "kitti", "--dataset", (folder_ / "empty").string()});
  expect_refusal("bag", {"--format", "bag"});
  fs::remove_all(folder_ / "mav0/cam1");
  expect_refusal("cam1", {"--mode", "stereo"});
}

TEST_F(RunRefuses, OptionsItDoesNotKnow) {
  expect_refusal("sideways", {"--mode", "sideways"});
  expect_refusal("gpu9", {"--device", "gpu9"});
  expect_refusal("sift", {"--family", "sift"});
  expect_refusal("--max-frames", {"--max-frames", "0"});
  expect_refusal("--threads", {"--threads", "-2"});
  expect_refusal("--seed", {"--seed", "soon"});
}

TEST_F(RunRefuses, ConfigurationsThatMakeNoSense) {
  expect_refusal("/nothing/rover.yaml", {"--config", "/nothing/rover.yaml"});
  expect_config_refusal("rover.yaml:2: unknown key 'featurs'", "seed: 1\nfeaturs: 500\n");
  expect_config_refusal("rover.yaml:1: 'model_sigma'", "model_sigma: .nan\n");
  expect_config_refusal("rover.yaml:3: 'keyframe.min_gap'",
                        "seed: 1\nkeyframe:\n  min_gap: a while\n");
  expect_config_refusal("rover.yaml:", "seed: 1\nkeyframe: {min_gap: 2, max_par");
  expect_config_refusal("sift", "family: sift\n");
}

TEST_F(RunRefuses, OutputItCannotWrite) {
  folder_.write("file", "in the way");
  expect_refusal("cannot be written", {"--output", (folder_ / "file").string()});
  expect_refusal("cannot be written", {"--output", (folder_ / "file/below").string()});
  EXPECT_EQ(folder_.read("file"), "in the way");
}

TEST_F(RunRefuses, ImagesUnlikeTheirCalibration) {
  folder_.write("other.yaml", camera_yaml(128, 96));
  expect_refusal("64x48", {"--calibration", (folder_ / "other.yaml").string()});
  expect_refusal("nothing.yaml", {"--calibration", "/nothing.yaml"});
}

TEST_F(RunRefuses, MasksThatDoNotFit) {
  folder_.write("words.png", "no image");
  expect_refusal("words.png", {"--mask", (folder_ / "words.png").string()});
  expect_refusal("nothing.png", {"--mask", (folder_ / "nothing.png").string()});
  if (!have_models()) GTEST_SKIP() << "the models are not here; the set-up makes them";
  folder_.write_image("mask.png", 30, 30);
  expect_refusal("mask", {"--mask", (folder_ / "mask.png").string()});
}

TEST_F(RunRefuses, ToGoOnWithoutModels) {
  fs::create_directories(folder_ / "models");
  const char* before = std::getenv("ROVER_MODELS");
  const std::string restored = before ? before : "";
  setenv("ROVER_MODELS", (folder_ / "models").c_str(), 1);
  expect_refusal("was not found (looked in " + (folder_ / "models").string(), {});
  if (before) {
    setenv("ROVER_MODELS", restored.c_str(), 1);
  } else {
    unsetenv("ROVER_MODELS");
  }
}

}  // namespace
}  // namespace rover
