#include "rover/evaluation/run_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/datasets/test_folder.h"
#include "rover/evaluation/verdict.h"

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kFrames = 40;

Trajectory circle(double radius) {
  Trajectory trajectory;
  for (int i = 0; i < kFrames; ++i) {
    const Eigen::Vector3d p(radius * std::cos(0.1 * i), radius * std::sin(0.1 * i), 0.02 * i);
    trajectory.push_back({from_seconds(0.1 * i), SE3(Eigen::Quaterniond::Identity(), p)});
  }
  return trajectory;
}

// Waiting for 5 frames, lost for 5 in the middle; 100 ms apart, 20 ms each.
RunFolder made_run() {
  RunFolder run;
  run.mode = "stereo";
  run.pose_frame = "cam0";
  run.final = circle(1);
  run.offered = {kFrames, 0, from_seconds(0.1 * (kFrames - 1))};
  for (int i = 0; i < kFrames; ++i) {
    const std::string state = i < 5 ? "waiting" : i >= 20 && i < 25 ? "lost" : "ok";
    run.frames.push_back({from_seconds(0.1 * i), state, 500, 200, 180, 20, 100.0 + i});
    ++run.states[state];
  }
  run.keyframes = {run.final[5], run.final[30]};
  run.stages = {{"features", 3, 8, 9, 9, {7, 8, 9}}};
  run.summary = {{"version", "0.1.0"}, {"config", {{"family", "orb"}}}, {"realtime", true}};
  return run;
}

std::string report_of(const RunFolder& run, const std::vector<Judgement>& judgements,
                      const std::vector<Trajectory>& estimates, const Trajectory& reference) {
  return run_report_html({"desk <1>", run, judgements, estimates, reference, {}, "none.ply"});
}

TEST(Verdict, SaysInWordsWhatHappened) {
  const RunFolder run = made_run();
  const auto judgement = judge("final", run.final, circle(1.1), 0.02, run.offered);
  const auto words = verdict(run, {judgement}, {});
  ASSERT_EQ(words.size(), 3u);
  EXPECT_THAT(words[0], AllOf(HasSubstr("40 of 40 frames"), HasSubstr("0.50 s after"),
                              HasSubstr("lost 1 time.")));
  EXPECT_THAT(words[1], AllOf(HasSubstr("rotation and translation"),
                              HasSubstr(length_words(judgement.rigid->position.rmse))));
  EXPECT_THAT(words[2], AllOf(HasSubstr("20.0 ms"), HasSubstr("every 100.0 ms"),
                              HasSubstr("keeps up with the camera.")));
}

TEST(Verdict, KnowsSlowRunsAndMissingGroundTruth) {
  RunFolder run = made_run();
  for (FrameLine& frame : run.frames) frame.frame_ms = 300;
  run.states["dropped"] = 7;
  const auto words = verdict(run, {}, {});
  EXPECT_THAT(words[0], HasSubstr("7 frames came too fast"));
  EXPECT_THAT(words[1], HasSubstr("no ground truth"));
  EXPECT_THAT(words[2], HasSubstr("slower than the camera"));
}

TEST(Verdict, GivesLengthsInFittingUnits) {
  EXPECT_EQ(length_words(0.0095), "9.5 mm");
  EXPECT_EQ(length_words(0.264), "26.4 cm");
  EXPECT_EQ(length_words(12.345), "12.35 m");
}

TEST(RunReport, ShowsEverythingOnOnePage) {
  const TestFolder folder;
  RunFolder run = made_run();
  folder.write_image("1.500000000.jpg", 64, 48);
  run.samples = {{from_seconds(1.5), folder / "1.500000000.jpg"}};
  const std::vector<Judgement> judgements = {
      judge("final", run.final, circle(1.1), 0.02, run.offered),
      judge("<peer>", circle(1.2), circle(1.1), 0.02, run.offered)};
  const std::string html = report_of(run, judgements, {run.final, circle(1.2)}, circle(1.1));
  EXPECT_THAT(html,
              AllOf(HasSubstr("desk &lt;1&gt;"), HasSubstr("&lt;peer&gt;"), HasSubstr("ATE SE(3)"),
                    HasSubstr("position error [m"), HasSubstr("rotation error [deg]"),
                    HasSubstr("features"), HasSubstr("memory [MB]"),
                    HasSubstr("data:image/jpeg;base64,"), HasSubstr("0.1.0"), HasSubstr("family")));
  EXPECT_THAT(html,
              AllOf(Not(HasSubstr("http")), Not(HasSubstr("<script")), Not(HasSubstr("nan"))));
}

TEST(RunReport, ShowsTheInertialState) {
  RunFolder run = made_run();
  EXPECT_THAT(report_of(run, {}, {}, {}), Not(HasSubstr("Inertial state")));
  for (int i = 10; i < kFrames; ++i) {
    run.motion.push_back({from_seconds(0.1 * i), {1, 2, 3, .1, .2, .3, 0, 0, .5}, {}});
    run.motion.back().sigmas.fill(0.01);
  }
  run.summary["inertial"]["events"] = {
      {{"time", "1.25"}, {"event", "initialised"}, {"scale_sigma", 0.04}}};
  EXPECT_THAT(report_of(run, {}, {}, {}),
              AllOf(HasSubstr("Inertial state"), HasSubstr("velocity [m/s]"), HasSubstr("3 sigma"),
                    HasSubstr("accelerometer bias [m/s2]"), HasSubstr("initialised"),
                    HasSubstr("1.25"), HasSubstr("4.00"), Not(HasSubstr("nan"))));
}

TEST(RunReport, DoesWithoutGroundTruthAndPictures) {
  const RunFolder run = made_run();
  const std::string html = report_of(run, {}, {}, {});
  EXPECT_THAT(html, AllOf(HasSubstr("no ground truth"), HasSubstr("Trajectory"),
                          Not(HasSubstr("Errors over time")), Not(HasSubstr("<img"))));
}

}  // namespace
}  // namespace rover
