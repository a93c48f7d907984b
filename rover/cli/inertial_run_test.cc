// `rover run` in inertial modes, from end to end, on the real flight's clip.
#include <gmock/gmock.h>

#include "rover/cli/finished_run.h"

namespace rover {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kClipScaleError = 0.06;
constexpr double kClipError = 0.024;  // m

TEST(InertialRun, FindsScaleAndGravityOfAShortFlight) {
  SKIP_UNLESS_PRESENT(kClip);
  const FinishedRun run(sequence_folder(kClip), "mono-inertial");
  const auto summary = run.summary();
  EXPECT_EQ(summary["mode"], "mono-inertial");
  EXPECT_EQ(summary["pose_frame"], "body");
  EXPECT_EQ(summary["inertial"]["state"], "aligned");
  EXPECT_EQ(summary["inertial"]["alignments"], 1);
  EXPECT_EQ(summary["inertial"]["events"][0]["event"], "initialised");
  EXPECT_EQ(summary["inertial"]["events"][0]["time"].get<std::string>().size(), 20U);
  const Judgement final = run.judge_file("trajectory_final.txt");
  ASSERT_TRUE(final.similarity.has_value() && final.rigid.has_value());
  const double scale_error = std::abs(final.similarity->reference_from_estimate.scale - 1);
  const double sigma = summary["inertial"]["scale_sigma"].get<double>();
  std::printf(
      "V1_01 clip, mono-inertial: ATE SE(3) %.4f m, scale off by %.1f%%, said to be known "
      "to %.1f%%\n",
      final.rigid->position.rmse, 100 * scale_error, 100 * sigma);
  EXPECT_GE(final.coverage.value(), 0.95);
  EXPECT_LE(final.rigid->position.rmse, kClipError);
  EXPECT_LE(scale_error, kClipScaleError);
  EXPECT_LE(scale_error, 2 * sigma);
}

TEST(InertialRun, TellsStatesWithDeviationsOnceAligned) {
  SKIP_UNLESS_PRESENT(kClip);
  const FinishedRun run(sequence_folder(kClip), "mono-inertial");
  const std::string states = run.read("states.csv");
  EXPECT_THAT(states, StartsWith("time,vx,vy,vz,bgx,"));
  const auto lines = [](const std::string& text) { return std::ranges::count(text, '\n'); };
  EXPECT_EQ(lines(states), lines(run.read("trajectory_causal.txt")) + 1);
  EXPECT_LT(lines(states), 90);  // nothing before scale and gravity were known
  EXPECT_GT(lines(states), 20);
  const FinishedRun again(sequence_folder(kClip), "mono-inertial");
  for (const char* file : {"states.csv", "trajectory_final.txt", "trajectory_causal.txt"}) {
    EXPECT_EQ(run.read(file), again.read(file)) << file;
  }
}

// The clip ends before the second, finer estimate would come: turns alone tell the offset.
TEST(InertialRun, FindsClocksThatAreApart) {
  SKIP_UNLESS_PRESENT(kClip);
  const FlightPiece piece(90);
  piece.delay_imu(40'000'000);
  const TestFolder config;
  config.write("offset.yaml",
               "inertial:\n  estimate_time_offset: true\n  first_calibration: 0.5\n");
  const Arguments options = {"--config", (config.path() / "offset.yaml").string()};
  const FinishedRun run(piece.path(), "mono-inertial", options);
  const auto inertial = run.summary()["inertial"];
  EXPECT_EQ(inertial["state"], "aligned");
  const auto& found = inertial["calibration"];
  EXPECT_NEAR(found["time_offset"]["value_s"].get<double>(), 0.04, 0.006);
  EXPECT_EQ(found["time_offset"]["given_s"].get<double>(), 0);
  EXPECT_GE(found["changes"].get<int>(), 1);
  EXPECT_FALSE(found.contains("extrinsics"));
  EXPECT_THAT(run.outcome().out, HasSubstr("calibration  "));
  const FinishedRun again(piece.path(), "mono-inertial", options);
  EXPECT_EQ(run.read("trajectory_final.txt"), again.read("trajectory_final.txt"));
}

TEST(InertialRun, TakesTheCalibrationAsGivenUnlessAskedTo) {
  SKIP_UNLESS_PRESENT(kClip);
  const FinishedRun run(sequence_folder(kClip), "mono-inertial", {"--max-frames", "40"});
  EXPECT_FALSE(run.summary()["inertial"].contains("calibration"));
}

TEST(InertialRun, WaitsForExcitation) {
  SKIP_UNLESS_PRESENT(kClip);
  const FinishedRun run(sequence_folder(kClip), "mono-inertial", {"--max-frames", "40"});
  EXPECT_THAT(run.summary()["inertial"]["state"].get<std::string>(),
              StartsWith("waiting for excitation: "));
  EXPECT_EQ(run.read("trajectory_causal.txt"), "");
  EXPECT_GT(run.read("trajectory_final.txt").size(), 1000u);  // the visual map is there
}

TEST(InertialRun, ReckonsThroughDarkness) {
  SKIP_UNLESS_PRESENT(kClip);
  const FlightPiece piece(90);
  for (std::size_t i = 70; i < 78; ++i) piece.blacken(i);
  const FinishedRun run(piece.path(), "mono-inertial");
  const auto states = run.states();
  ASSERT_EQ(states.size(), 90u);
  EXPECT_EQ(std::count(states.begin() + 70, states.begin() + 78, "dead-reckoning"), 8);
  EXPECT_GE(std::count(states.begin() + 78, states.end(), "ok"), 11);
  EXPECT_EQ(run.summary()["maps"], 1);
  EXPECT_EQ(run.summary()["lost_events"], 0);
  const auto gaps = run.summary()["input"]["vision_gaps"];
  ASSERT_EQ(gaps.size(), 1u);
  EXPECT_EQ(gaps[0]["frames"], 8);
  EXPECT_NEAR(gaps[0]["length"].get<double>(), 0.45, 0.01);
  EXPECT_LT(gaps[0]["drift_m"].get<double>(), 0.05);
  EXPECT_THAT(run.outcome().err, HasSubstr("vision lost at "));
}

TEST(InertialRun, PassesOverImagesThatRepeat) {
  SKIP_UNLESS_PRESENT(kClip);
  const FlightPiece piece(90);
  piece.repeat(20);  // before the map is aligned: left out
  for (std::size_t i = 70; i < 86; i += 3) piece.repeat(i);
  const FinishedRun run(piece.path(), "mono-inertial");
  EXPECT_EQ(run.summary()["input"]["repeated_images"], 7);
  EXPECT_EQ(run.summary()["maps"], 1);
  EXPECT_THAT(run.outcome().err, HasSubstr("7 images repeated"));
  const auto states = run.states();
  EXPECT_EQ(states[20], "skipped");
  EXPECT_EQ(std::count(states.begin() + 70, states.end(), "dead-reckoning"), 6);
  EXPECT_EQ(std::ranges::count(run.read("trajectory_final.txt"), '\n'), 89);
}

TEST(InertialRun, NeedsAnInertialSensor) {
  SKIP_UNLESS_PRESENT(kClip);
  const TestFolder output;
  const Outcome outcome = call({"--dataset", sequence_folder("tum_rgbd/freiburg1_xyz").string(),
                                "--mode", "mono-inertial", "--output", output.path().string()});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.err, HasSubstr("inertial"));
}

}  // namespace
}  // namespace rover
