#include "rover/evaluation/live_judgement.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rover/base/error.h"

namespace rover {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::SizeIs;

constexpr double kInterval = 0.05;

SE3 winding(double t) {
  return {so3_exp({0.1 * std::sin(t), 0, 0.5 * t}),
          {3 * std::cos(0.4 * t), 2 * std::sin(0.5 * t), std::sin(0.3 * t)}};
}

Trajectory ground_truth(double seconds) {
  Trajectory trajectory;
  for (int i = 0; i * 0.005 <= seconds; ++i) {
    trajectory.push_back({from_seconds(0.005 * i), winding(0.005 * i)});
  }
  return trajectory;
}

// A run of `seconds` at 20 Hz that knows all from 2 s on, in a world of its own.
RunFolder perfect_run(double seconds) {
  RunFolder run;
  run.mode = "mono-inertial";
  run.pose_frame = "body";
  const SE3 world_from_truth(so3_exp({0, 0, 1}), {5, 6, 7});
  for (int i = 0; i * kInterval <= seconds; ++i) {
    const Timestamp time = from_seconds(kInterval * i);
    FrameLine line;
    line.time = time;
    line.state = i < 40 ? "waiting" : "ok";
    run.frames.push_back(line);
    if (i < 40) continue;
    run.final.push_back({time, world_from_truth * winding(kInterval * i)});
  }
  run.causal = run.odometry = run.final;
  run.offered = {run.frames.size(), 0, run.frames.back().time};
  return run;
}

std::size_t frame_at(double seconds) {
  return static_cast<std::size_t>(std::lround(seconds / kInterval));
}

StampedPose& pose_at(Trajectory& trajectory, double seconds) {
  return trajectory[frame_at(seconds) - 40];
}

void move_from(Trajectory& trajectory, double seconds, const Eigen::Vector3d& by) {
  for (StampedPose& stamped : trajectory) {
    if (stamped.time >= from_seconds(seconds)) stamped.pose.translation += by;
  }
}

LiveJudgement judged(const RunFolder& run) { return judge_live(run, ground_truth(60), {}); }

TEST(LiveJudgement, FindsNothingWrongWithATrueRun) {
  const LiveJudgement live = judged(perfect_run(40));
  EXPECT_DOUBLE_EQ(live.initialised.value(), 2);
  EXPECT_DOUBLE_EQ(live.coverage.value(), 1);
  EXPECT_LT(live.late.value().max, 1e-9);
  EXPECT_EQ(live.late->count, 401U);
  EXPECT_LT(std::abs(live.early_scale.value().percent), 1e-6);
  EXPECT_DOUBLE_EQ(live.early_scale->begin, 17);
  EXPECT_DOUBLE_EQ(live.early_scale->end, 27);
  EXPECT_LT(std::abs(live.final_scale.value().percent), 1e-6);
  EXPECT_LT(live.causal_step.value().metres, 1e-8);
  EXPECT_LT(live.odometry_step.value().metres, 1e-8);
  EXPECT_THAT(live.gaps, SizeIs(0));
  EXPECT_FALSE(live.causal_split);
}

TEST(LiveJudgement, LateErrorLeavesTheBeginningOut) {
  RunFolder run = perfect_run(40);
  move_from(run.causal, 20, {1, 0, 0});  // the same for all that counts
  EXPECT_LT(judged(run).late.value().max, 1e-9);
  move_from(run.causal, 30, {0.1, 0, 0});
  EXPECT_NEAR(judged(run).late.value().rmse, 0.05, 0.01);
  EXPECT_FALSE(judged(perfect_run(19)).late);
}

TEST(LiveJudgement, EarlyScaleIsThatOfItsWindow) {
  RunFolder run = perfect_run(40);
  for (StampedPose& stamped : run.causal) {
    const double scale = stamped.time < from_seconds(17) ? 2 : 1.03;
    stamped.pose.translation *= scale;
  }
  for (StampedPose& stamped : run.final) stamped.pose.translation *= 0.99;
  EXPECT_NEAR(judged(run).early_scale.value().percent, 3, 1e-6);
  EXPECT_NEAR(judged(run).final_scale.value().percent, -1, 1e-6);
}

TEST(LiveJudgement, ShortRunsHaveAShorterWindowOrNone) {
  EXPECT_DOUBLE_EQ(judged(perfect_run(23)).early_scale.value().end, 23);
  EXPECT_FALSE(judged(perfect_run(21)).early_scale);
}

TEST(LiveJudgement, StepsAreToldUnlessAnnounced) {
  RunFolder run = perfect_run(40);
  move_from(run.causal, 10, {0.2, 0, 0});
  move_from(run.odometry, 12, {0, 0.03, 0});
  LiveJudgement live = judged(run);
  EXPECT_NEAR(live.causal_step.value().metres, 0.2, 1e-6);
  EXPECT_DOUBLE_EQ(live.causal_step->time, 10);
  EXPECT_NEAR(live.odometry_step.value().metres, 0.03, 1e-6);
  EXPECT_DOUBLE_EQ(live.odometry_step->time, 12);
  for (std::size_t i = frame_at(10); i < run.frames.size(); ++i) run.frames[i].epoch = 1;
  for (std::size_t i = frame_at(12); i < run.frames.size(); ++i) run.frames[i].epoch = 2;
  live = judged(run);
  EXPECT_LT(live.causal_step.value().metres, 1e-8);
  EXPECT_NEAR(live.odometry_step.value().metres, 0.03, 1e-6);  // never jumps, whatever the epoch
}

TEST(LiveJudgement, StepsCountOverDroppedFramesButNotOverLosses) {
  RunFolder run = perfect_run(40);
  move_from(run.causal, 10, {0.2, 0, 0});
  run.causal.erase(run.causal.begin() + (&pose_at(run.causal, 10) - run.causal.data()));
  run.frames[frame_at(10)].state = "dropped";
  EXPECT_NEAR(judged(run).causal_step.value().metres, 0.2, 1e-6);
  run.frames[frame_at(10)].state = "lost";
  EXPECT_LT(judged(run).causal_step.value().metres, 1e-8);
}

TEST(LiveJudgement, CoverageCountsFromTheFirstPose) {
  RunFolder run = perfect_run(42);
  run.final.resize(run.final.size() / 2);
  EXPECT_NEAR(judged(run).coverage.value(), 0.5, 0.001);
}

TEST(LiveJudgement, ErrorsInDeadReckoningAreApart) {
  RunFolder run = perfect_run(40);
  for (const double begin : {10.0, 30.0}) {
    for (std::size_t i = frame_at(begin); i < frame_at(begin + 1); ++i) {
      run.frames[i].state = "dead-reckoning";
      run.causal[i - 40].pose.translation.x() += begin == 10 ? 0.1 : 0.3;
    }
  }
  const LiveJudgement live = judged(run);
  ASSERT_THAT(live.gaps, SizeIs(2));
  EXPECT_DOUBLE_EQ(live.gaps[0].begin, 10);
  EXPECT_DOUBLE_EQ(live.gaps[0].end, 10.95);
  EXPECT_EQ(live.gaps[0].frames, 20U);
  EXPECT_NEAR(live.gaps[0].drift.value(), 0.1, 1e-6);
  EXPECT_NEAR(live.gaps[1].drift.value(), 0.3, 1e-6);
  ASSERT_TRUE(live.causal_split);
  EXPECT_NEAR(live.causal_split->inside.rmse, std::sqrt(0.05), 1e-6);
  EXPECT_NEAR(live.causal_split->inside.max, 0.3, 1e-6);
  EXPECT_LT(live.causal_split->outside.max, 1e-9);
  EXPECT_LT(live.final_split.value().inside.max, 1e-9);
}

TEST(LiveJudgement, IsToldInJsonAndRows) {
  const LiveJudgement live = judged(perfect_run(40));
  const auto json = to_json(live, {});
  EXPECT_EQ(json["coverage"], 1);
  EXPECT_EQ(json["late_ate_m"]["poses"], 401);
  EXPECT_EQ(json["early_scale"]["begin_s"], 17);
  EXPECT_FALSE(json.contains("causal_gaps"));
  EXPECT_THAT(live_rows(live, {}), Contains(ElementsAre("coverage from then on [%]", "100.0")));
  EXPECT_THAT(live_rows(LiveJudgement(), {}), SizeIs(1));
}

TEST(LiveJudgement, RefusesWindowsThatAreNone) {
  LiveOptions options;
  options.from = -1;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.scale_span = 1;
  EXPECT_THROW(options.check(), InputError);
}

TEST(PairWithInterpolated, LiesBetweenItsNeighbours) {
  const Trajectory reference = {{0, winding(0)}, {100, winding(1)}, {900, winding(2)}};
  const auto pairs = pair_with_interpolated({{25, SE3()}, {100, SE3()}, {500, SE3()}, {950, SE3()}},
                                            reference, 5e-7);
  ASSERT_THAT(pairs, SizeIs(2));
  const Eigen::Vector3d expected = 0.75 * winding(0).translation + 0.25 * winding(1).translation;
  EXPECT_LT((pairs[0].reference.translation - expected).norm(), 1e-12);
  EXPECT_EQ(pairs[1].reference.translation, winding(1).translation);
}

}  // namespace
}  // namespace rover
