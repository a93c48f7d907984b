#include "rover/slam/trajectory_smoothing.h"

#include <gtest/gtest.h>

#include "rover/imu/simulated_motion.h"
#include "rover/map/test_map.h"

namespace rover {
namespace {

// Two keyframes of an aligned map, .5 s apart on a lively motion, and nine frames in between that
// tracking had off by some millimetres.
struct Flown {
  static constexpr double kTracked = 0.005;  // m, deviation

  SimulatedMotion motion;
  Map map{MapId{0}, std::make_shared<const Rig>(test_rig()), std::make_shared<IdSource>()};
  KeyframeId second;
  std::vector<FinalPose> poses;
  std::vector<Matrix6d> tracked;

  explicit Flown(std::uint64_t seed) {
    Random random(seed);
    motion = SimulatedMotion::random(random);
    add(0);
    second = add(10);
    const ImuNoise noise = simulated_noise(10);
    map.set_motion(second,
                   std::make_shared<const Preintegration>(
                       simulate_imu(motion, 0, 0.5, 200, {}, noise, random), ImuBias{}, noise));
    map.set_inertial({.aligned = true});
    for (int i = 0; i <= 10; ++i) track(i, i % 10 == 0 ? 0 : kTracked, random);
  }

  KeyframeId add(int frame) {
    const InertialState state = motion.state(0.05 * frame);
    const KeyframeId id = map.add_keyframe(test_frame(map.rig(), {}, state.world_from_body, frame));
    map.set_velocity(id, state.velocity, state.bias);
    return id;
  }

  void track(int frame, double sigma, Random& random) {
    SE3 pose = motion.pose(0.05 * frame);
    pose.translation += sigma * random_gaussian_vector(random);
    poses.push_back({FrameId{frame}, from_seconds(0.05 * frame), pose});
    tracked.emplace_back(kTracked * kTracked * Matrix6d::Identity());
  }

  // Root mean square over the frames in between, m.
  double error() const {
    double sum = 0;
    for (int i = 1; i < 10; ++i) {
      const Eigen::Vector3d truth = motion.pose(0.05 * i).translation;
      sum += (poses[static_cast<std::size_t>(i)].world_from_body.translation - truth).squaredNorm();
    }
    return std::sqrt(sum / 9);
  }
  void smooth() { smooth_between_keyframes(map, poses, tracked); }
};

TEST(TrajectorySmoothing, TakesTheNoiseOfTrackingOut) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Flown flown(seed);
    const double before = flown.error();
    const SE3 first = flown.poses.front().world_from_body,
              last = flown.poses.back().world_from_body;
    flown.smooth();
    EXPECT_LT(flown.error(), 0.3 * before) << seed;
    EXPECT_EQ(se3_minus(flown.poses.front().world_from_body, first).norm(), 0);
    EXPECT_EQ(se3_minus(flown.poses.back().world_from_body, last).norm(), 0);
  }
}

TEST(TrajectorySmoothing, LeavesFramesThatAreKnownBetter) {
  Flown flown(1);
  const double before = flown.error();
  for (Matrix6d& covariance : flown.tracked) covariance = 1e-12 * Matrix6d::Identity();
  flown.smooth();
  EXPECT_NEAR(flown.error(), before, 1e-5);
}

TEST(TrajectorySmoothing, NeedsNoTrackingAtAll) {
  Flown flown(2);
  for (Matrix6d& covariance : flown.tracked) covariance.setZero();
  flown.smooth();
  EXPECT_LT(flown.error(), 0.002);
}

void expect_unmoved(Flown& flown) {
  const double before = flown.error();
  flown.smooth();
  EXPECT_EQ(flown.error(), before);
}

TEST(TrajectorySmoothing, LeavesWhatInertialDataContradict) {
  Flown flown(3);
  SE3 pose = flown.map.at(flown.second).world_from_body();
  pose.translation.x() += 0.5;
  flown.map.set_pose(flown.second, pose);
  expect_unmoved(flown);
}

TEST(TrajectorySmoothing, LeavesMapsThatAreNotAligned) {
  Flown flown(4);
  flown.map.set_inertial({});
  expect_unmoved(flown);
}

TEST(TrajectorySmoothing, LeavesFramesWithoutInertialDataAround) {
  Flown flown(5);
  flown.map.set_motion(flown.second, nullptr);
  expect_unmoved(flown);
}

}  // namespace
}  // namespace rover
