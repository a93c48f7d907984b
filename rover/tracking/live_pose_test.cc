#include "rover/tracking/live_pose.h"

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/geometry/random_geometry.h"

namespace rover {
namespace {

constexpr double kPeriod = 0.05;  // s between frames

double angle(const SE3& a, const SE3& b) { return a.rotation.angularDistance(b.rotation); }
double distance(const SE3& a, const SE3& b) { return (a.translation - b.translation).norm(); }

// A body that moves by the same way in each frame, and what tracking says of it.
class LivePoseTest : public ::testing::Test {
 protected:
  // The next frame; tracking finds the body `off` from where it is.
  LivePose next(const SE3& off = {}, int epoch = 0, bool felt = true) {
    ++frame_;
    truth_ = truth_ * way_;
    TrackingResult result;
    result.anchored.time = from_seconds(frame_ * kPeriod);
    result.anchored.map = {0};
    result.epoch = epoch;
    result.world_from_body = off * truth_;
    // Odometry sees the motion through one map: what an epoch moves is no motion.
    const bool moved = epoch != epoch_;
    result.last_from_body = moved ? way_ : found_.inverse() * result.world_from_body;
    epoch_ = epoch;
    found_ = result.world_from_body;
    return filter_.follow(result, felt ? std::optional(way_) : std::nullopt);
  }

  // How far a pose has gone from the one before, less the way of the body.
  double step(const SE3& before, const SE3& now) const { return distance(before * way_, now); }

  Random random_{1};
  SE3 way_ = random_pose(random_, 0.02, 0.03);
  SE3 truth_ = random_pose(random_, 3);
  SE3 found_ = truth_;
  int frame_ = 0, epoch_ = 0;
  LivePoseFilter filter_{{.settling_time = 0.25}};
};

const SE3 kOff(Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitZ())), {0.05, 0, 0});

TEST_F(LivePoseTest, FollowsExactlyWhereNothingIsCorrected) {
  for (int i = 0; i < 100; ++i) {
    const LivePose live = next();
    EXPECT_LT(distance(live.world_from_body, truth_), 1e-9);
    EXPECT_LT(distance(live.odometry_from_body, truth_), 1e-9);
  }
}

TEST_F(LivePoseTest, CorrectionsComeInOverAWhile) {
  LivePose before = next();
  for (int i = 0; i < 40; ++i) {
    const LivePose live = next(kOff);
    const double left = std::exp(-(i + 1) * kPeriod / 0.25);
    EXPECT_NEAR(angle(live.world_from_body, found_), 0.01 * left, 1e-6);
    EXPECT_LT(step(before.world_from_body, live.world_from_body), 0.012);
    EXPECT_LT(step(before.odometry_from_body, live.odometry_from_body), 0.012);
    before = live;
  }
  EXPECT_LT(distance(before.world_from_body, found_), 1e-3);
  EXPECT_LT(distance(before.odometry_from_body, found_), 1e-3);
}

TEST_F(LivePoseTest, TakesAnAnnouncedStepAtOnceAndOdometryNone) {
  const LivePose before = next();
  const LivePose live = next(kOff, 1);
  EXPECT_EQ(distance(live.world_from_body, found_), 0);
  EXPECT_LT(step(before.odometry_from_body, live.odometry_from_body), 1e-9);
}

TEST_F(LivePoseTest, WithoutInertialDataCorrectsAtOnce) {
  next({}, 0, false);
  const LivePose live = next(kOff, 0, false);
  EXPECT_EQ(distance(live.world_from_body, found_), 0);
  EXPECT_LT(distance(live.odometry_from_body, found_), 1e-9);
}

TEST_F(LivePoseTest, AfterALossOdometryGoesOnFromWhereItWas) {
  next();
  const SE3 last = next().odometry_from_body;
  filter_.interrupt();
  const LivePose live = next(kOff);
  EXPECT_EQ(distance(live.world_from_body, found_), 0);
  EXPECT_EQ(distance(live.odometry_from_body, last), 0);
  const SE3 moved = live.odometry_from_body * way_;
  EXPECT_LT(distance(next(kOff).odometry_from_body, moved), 1e-9);
}

TEST_F(LivePoseTest, OdometryBeginsWithTheFirstMetricPose) {
  TrackingResult result;
  result.metric = false;
  result.world_from_body.translation.x() = 5;
  filter_.follow(result, std::nullopt);
  result.metric = true;
  result.anchored.time = 1;
  result.world_from_body.translation.x() = 2;
  EXPECT_EQ(filter_.follow(result, std::nullopt).odometry_from_body.translation.x(), 2);
}

TEST(LivePoseOptions, RefuseWhatMakesNoSense) {
  EXPECT_THROW(LivePoseOptions{-0.1}.check(), InputError);
  EXPECT_NO_THROW(LivePoseOptions{0}.check());
}

}  // namespace
}  // namespace rover
