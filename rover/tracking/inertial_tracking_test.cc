#include "rover/tracking/inertial_tracking.h"

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/imu/simulated_motion.h"
#include "rover/map/test_map.h"

namespace rover {
namespace {

constexpr ImuCalibration kSensor = {1.7e-4, 1.9e-5, 2e-3, 3e-3, 200};
const ImuBias kBias = {{0.01, -0.02, 0.03}, {0.1, 0, -0.1}};

// A body on a known motion, its readings, and an aligned map of one keyframe at time zero.
class InertialTrackingTest : public ::testing::Test {
 protected:
  InertialTrackingTest() : random_(3), motion_(SimulatedMotion::random(random_)) {
    const auto samples = simulate_imu(motion_, 0, 6, 200, kBias, simulated_noise(), random_);
    for (const ImuSample& sample : samples) tracking_.add(sample);
    map_.set_pose({0}, motion_.pose(0));
    map_.set_velocity({0}, motion_.state(0).velocity, kBias);
    map_.set_inertial({.aligned = true});
  }

  // What a frame sees of points around, exactly; the map has them `displaced`.
  std::vector<PoseObservation> look(double time,
                                    const Eigen::Vector3d& displaced = Eigen::Vector3d::Zero()) {
    std::vector<PoseObservation> seen;
    const SE3 body_from_world = motion_.pose(time).inverse();
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector3d point = 4 * random_gaussian_vector(random_);
      const auto pixel = map_.rig().cameras[0].project(body_from_world * point);
      if (!pixel || !map_.rig().cameras[0].contains(*pixel)) continue;
      seen.push_back({point + displaced, *pixel, 0, 1});
    }
    return seen;
  }

  double error(const SE3& pose, double time) const {
    return (pose.translation - motion_.pose(time).translation).norm();
  }

  Random random_;
  SimulatedMotion motion_;
  Map map_ = test_map(1, 20);
  InertialTracking tracking_{kSensor, {}};
};

TEST_F(InertialTrackingTest, KnowsNothingBeforeTheMapIsAligned) {
  map_.set_inertial({});
  tracking_.follow(map_);
  EXPECT_FALSE(tracking_.predict(from_seconds(0.05)));
  EXPECT_FALSE(tracking_.has_prediction());
  EXPECT_FALSE(tracking_.state());
  EXPECT_TRUE(tracking_.motion(from_seconds(0.1), from_seconds(0.2), {}));
  EXPECT_FALSE(tracking_.motion(from_seconds(5), from_seconds(7), {}));
}

// Readings that came before and those that come after are on the same clock.
TEST_F(InertialTrackingTest, ANewOffsetOfTheClockHoldsForAllReadings) {
  const auto before = tracking_.motion(from_seconds(1), from_seconds(1.5), kBias);
  tracking_.set_time_offset(from_seconds(0.02));
  EXPECT_EQ(tracking_.time_offset(), from_seconds(0.02));
  const auto moved = tracking_.motion(from_seconds(0.98), from_seconds(1.48), kBias);
  ASSERT_TRUE(before && moved);
  EXPECT_LT((before->delta().position - moved->delta().position).norm(), 1e-12);
  ImuSample next = motion_.sample(6.005, kBias);
  EXPECT_TRUE(tracking_.add(next));
  const auto after = tracking_.samples_after(from_seconds(5.97));
  ASSERT_EQ(after.size(), 4u);
  EXPECT_EQ(after.front().time, from_seconds(5.97));
  EXPECT_EQ(after.back().time, from_seconds(5.985));
  EXPECT_FALSE(tracking_.add(next));
}

TEST_F(InertialTrackingTest, FollowsTheMotion) {
  for (int i = 1; i <= 40; ++i) {
    tracking_.follow(map_);
    const auto predicted = tracking_.predict(from_seconds(0.05 * i));
    ASSERT_TRUE(predicted);
    EXPECT_LT(error(*predicted, 0.05 * i), 0.01);
    const PoseEstimate pose = tracking_.estimate(map_.rig(), look(0.05 * i));
    ASSERT_TRUE(pose.converged);
    EXPECT_LT(error(pose.world_from_body, 0.05 * i), 0.004);
    tracking_.accept();
  }
  const InertialState state = tracking_.state().value();
  EXPECT_LT((state.velocity - motion_.state(2).velocity).norm(), 0.03);
}

// From the frame before, and from one since the state that it was estimated from.
TEST_F(InertialTrackingTest, KnowsHowTheBodyMovedUpToAFrame) {
  tracking_.follow(map_);
  EXPECT_FALSE(tracking_.motion_since(0));
  ASSERT_TRUE(tracking_.predict(from_seconds(0.1)));
  tracking_.estimate(map_.rig(), look(0.1));
  tracking_.accept();
  for (const double begin : {0.0, 0.05}) {
    const auto moved = tracking_.motion_since(from_seconds(begin));
    ASSERT_TRUE(moved);
    const SE3 truth = motion_.pose(begin).inverse() * motion_.pose(0.1);
    EXPECT_LT(se3_minus(*moved, truth).norm(), 0.01);
  }
  tracking_.forget();
  EXPECT_FALSE(tracking_.motion_since(0));
}

TEST_F(InertialTrackingTest, DeadReckoningGrowsUncertain) {
  double before = 0;
  for (int i = 1; i <= 40; ++i) {
    tracking_.follow(map_);
    ASSERT_TRUE(tracking_.predict(from_seconds(0.05 * i)));
    const PoseEstimate pose = tracking_.estimate(map_.rig(), {});
    tracking_.accept();
    const double sigma = std::sqrt(pose.covariance.topLeftCorner<3, 3>().trace());
    EXPECT_GT(sigma, before);
    EXPECT_LT(error(pose.world_from_body, 0.05 * i), 4 * sigma);
    before = sigma;
  }
  EXPECT_GT(before, 0.03);
}

TEST_F(InertialTrackingTest, CorrectsWhatItReckonedOnceItSees) {
  std::vector<double> reckoned;
  for (int i = 1; i <= 40; ++i) {
    tracking_.follow(map_);
    ASSERT_TRUE(tracking_.predict(from_seconds(0.05 * i)));
    const bool seen = i < 10 || i == 40;
    const PoseEstimate pose =
        tracking_.estimate(map_.rig(), seen ? look(0.05 * i) : std::vector<PoseObservation>());
    tracking_.accept(seen);
    if (!seen) reckoned.push_back(error(pose.world_from_body, 0.05 * i));
  }
  const auto& smoothed = tracking_.smoothed();
  ASSERT_EQ(smoothed.size(), reckoned.size());
  double before = 0, after = 0;
  for (std::size_t k = 0; k < smoothed.size(); ++k) {
    EXPECT_EQ(smoothed[k].time, from_seconds(0.05 * (static_cast<double>(k) + 10)));
    before += reckoned[k];
    after += error(smoothed[k].state.world_from_body, seconds_between(0, smoothed[k].time));
  }
  EXPECT_LT(after, before);
  tracking_.predict(from_seconds(2.05));
  tracking_.estimate(map_.rig(), look(2.05));
  tracking_.accept();
  EXPECT_TRUE(tracking_.smoothed().empty());
}

TEST_F(InertialTrackingTest, IsSureOfItsVelocityWhereItStandsStill) {
  const auto sigma_after = [&] {
    tracking_.predict(from_seconds(0.05));
    tracking_.estimate(map_.rig(), {});
    return std::sqrt(tracking_.covariance().block<3, 3>(6, 6).trace() / 3);
  };
  tracking_.follow(map_);
  const double free = sigma_after();
  tracking_.hold_still(0.005);
  EXPECT_LT(sigma_after(), 0.005);
  tracking_.release();
  EXPECT_NEAR(sigma_after(), free, 1e-9);
}

// Old landmarks come back into view, and the map has them elsewhere than the new ones.
TEST_F(InertialTrackingTest, APartOfTheMapElsewhereMovesThePlaceNotTheVelocity) {
  const Eigen::Vector3d displaced(0.04, 0, 0);
  struct Worst {
    double place = 0, velocity = 0;
  };
  const auto fly = [&](InertialTracking& tracking) {
    Worst worst;
    for (int i = 1; i <= 25; ++i) {
      const double time = 0.05 * i;
      tracking.follow(map_);
      EXPECT_TRUE(tracking.predict(from_seconds(time)));
      const Eigen::Vector3d off = i > 20 ? displaced : Eigen::Vector3d::Zero();
      const PoseEstimate pose = tracking.estimate(map_.rig(), look(time, off));
      tracking.accept();
      const Eigen::Vector3d expected = motion_.pose(time).translation + off;
      const double place = (pose.world_from_body.translation - expected).norm();
      const double velocity = (tracking.state()->velocity - motion_.state(time).velocity).norm();
      worst = {std::max(worst.place, place), std::max(worst.velocity, velocity)};
    }
    return worst;
  };
  InertialTrackingOptions rigid;
  rigid.max_tension = 1e9;
  InertialTracking torn(kSensor, rigid);
  for (const ImuSample& sample : tracking_.samples_after(0)) torn.add(sample);
  const Worst slipped = fly(tracking_), without = fly(torn);
  EXPECT_LT(slipped.place, 0.015);
  EXPECT_LT(slipped.velocity, 0.05);
  EXPECT_GT(without.place, 0.03);
  EXPECT_GT(without.velocity, 0.15);
}

TEST_F(InertialTrackingTest, TakesUpWhatMappingChanges) {
  tracking_.follow(map_);
  ASSERT_TRUE(tracking_.predict(from_seconds(0.1)));
  tracking_.estimate(map_.rig(), {});
  tracking_.accept();
  const Eigen::Vector3d shift(0.3, 0, 0);
  SE3 moved = motion_.pose(0);
  moved.translation += shift;
  map_.set_pose({0}, moved);
  tracking_.follow(map_);
  const auto predicted = tracking_.predict(from_seconds(0.2));
  ASSERT_TRUE(predicted);
  EXPECT_NEAR(error(*predicted, 0.2), 0.3, 0.01);
}

TEST_F(InertialTrackingTest, BeginsAgainWithoutAVelocity) {
  tracking_.follow(map_);
  tracking_.forget();
  tracking_.follow(map_);
  EXPECT_FALSE(tracking_.predict(from_seconds(1)));
  tracking_.restart(from_seconds(1), motion_.pose(1), Eigen::Vector3d::Zero(), 2);
  for (int i = 1; i <= 20; ++i) {
    tracking_.follow(map_);
    ASSERT_TRUE(tracking_.predict(from_seconds(1 + 0.05 * i)));
    tracking_.estimate(map_.rig(), look(1 + 0.05 * i));
    tracking_.accept();
  }
  EXPECT_LT((tracking_.state()->velocity - motion_.state(2).velocity).norm(), 0.05);
}

TEST(InertialTrackingOptions, RefuseWhatMakesNoSense) {
  InertialTrackingOptions options;
  options.velocity_sigma = 0;
  EXPECT_THROW(InertialTracking(kSensor, options), InputError);
  options = {};
  options.max_tension = 0;
  EXPECT_THROW(InertialTracking(kSensor, options), InputError);
  options = {};
  options.slip_position_sigma = 0;
  EXPECT_THROW(InertialTracking(kSensor, options), InputError);
  options = {};
  options.max_interval = 0;
  EXPECT_THROW(InertialTracking(kSensor, options), InputError);
}

}  // namespace
}  // namespace rover
