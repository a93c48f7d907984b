#include "rover/slam/final_trajectory.h"

#include <gtest/gtest.h>

#include "rover/map/test_map.h"

namespace rover {
namespace {

constexpr Timestamp kMillisecond = 1'000'000;
constexpr KeyframeId kFirst{0}, kSecond{1};

// Keyframes 0 and 1, .05 s apart, and four frames on the way that were anchored to the first, all
// tracked on a straight line as the map has them.
struct Tracked {
  Map map = test_map(2, 30);
  std::vector<PlacedFrame> placed;
  std::map<FrameId, TrackedMotion> keyframes;
  SE3 step;

  Tracked() {
    const Keyframe &first = map.at(kFirst), &second = map.at(kSecond);
    const SE3 way = first.world_from_body().inverse() * second.world_from_body();
    step = se3_exp(se3_log(way) / 5);
    SE3 pose;
    for (int i = 0; i < 5; ++i) {
      const FrameId frame = i == 0 ? first.frame.id : FrameId{100 + i};
      placed.push_back({{frame, i * 10 * kMillisecond, map.id(), first.id, pose, map.units()}});
      pose = pose * step;
    }
    placed.push_back(
        {{second.frame.id, second.frame.time, map.id(), second.id, SE3(), map.units()}});
    keyframes[second.frame.id] = {step, map.units()};
  }

  // By 5 cm, as an adjustment would.
  void correct_second() {
    SE3 pose = map.at(kSecond).world_from_body();
    pose.translation += Eigen::Vector3d(0, 0.05, 0);
    map.set_pose(kSecond, pose);
  }
  std::vector<FinalPose> poses() const { return final_trajectory(map, placed, keyframes); }
  // How far each frame is, now, from where tracking had it.
  std::vector<double> moved(const std::vector<FinalPose>& before) const {
    const auto after = poses();
    std::vector<double> result;
    for (std::size_t i = 0; i < after.size(); ++i) {
      result.push_back(
          (after[i].world_from_body.translation - before[i].world_from_body.translation).norm());
    }
    return result;
  }
};

TEST(FinalTrajectory, IsThatOfTrackingWhereTheMapAgrees) {
  const Tracked tracked;
  const auto poses = tracked.poses();
  ASSERT_EQ(poses.size(), 6U);
  SE3 expected = tracked.map.at(kFirst).world_from_body();
  for (const FinalPose& pose : poses) {
    EXPECT_LT(se3_minus(pose.world_from_body, expected).norm(), 1e-12);
    expected = expected * tracked.step;
  }
}

TEST(FinalTrajectory, SpreadsWhatTrackingMissedTheNextKeyframeBy) {
  Tracked tracked;
  const auto before = tracked.poses();
  tracked.correct_second();
  const auto moved = tracked.moved(before);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(moved[i], 0.01 * static_cast<double>(i), 1e-9) << i;
  }
}

TEST(FinalTrajectory, FollowsAChangeOfScale) {
  Tracked tracked;
  const auto before = tracked.poses();
  tracked.map.rescale(2);
  for (const KeyframeId id : {kFirst, kSecond}) {
    SE3 pose = tracked.map.at(id).world_from_body();
    pose.translation *= 2;
    tracked.map.set_pose(id, pose);
  }
  const auto after = tracked.poses();
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_LT(
        (after[i].world_from_body.translation - 2 * before[i].world_from_body.translation).norm(),
        1e-9);
  }
}

// The frame before was lost long ago, or never tracked: there is nothing to spread.
TEST(FinalTrajectory, LeavesFramesBeforeAGap) {
  Tracked tracked;
  const auto before = tracked.poses();
  tracked.correct_second();
  tracked.placed.back().anchored.time += 1000 * kMillisecond;
  auto moved = tracked.moved(before);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_LT(moved[i], 1e-12);
  tracked.placed.back().anchored.time -= 1000 * kMillisecond;
  tracked.keyframes.clear();
  moved = tracked.moved(before);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_LT(moved[i], 1e-12);
}

TEST(FinalTrajectory, TakesFramesOfItsMapOnly) {
  Tracked tracked;
  tracked.placed[2].anchored.map = {7};
  EXPECT_EQ(tracked.poses().size(), 5U);
}

}  // namespace
}  // namespace rover
