#include "rover/slam/final_trajectory.h"

#include <algorithm>

namespace rover {
namespace {

// s: the frame before a keyframe is no longer ago, and keyframes are no farther apart; else frames
// were lost in between.
constexpr double kFrames = 0.5;
constexpr double kKeyframes = 5;

// By how much the map has a keyframe elsewhere than tracking came to: in the keyframe's own frame.
SE3 miss_of(const Map& map, const TrackedMotion& motion, const FinalPose& last,
            const FinalPose& keyframe) {
  const SE3 last_from_keyframe = map.rescale_relative(motion.last_from_body, motion.units);
  return (last.world_from_body * last_from_keyframe).inverse() * keyframe.world_from_body;
}

void spread(const SE3& miss, std::span<FinalPose> between, const FinalPose& from,
            const FinalPose& to) {
  const Vector6d whole = se3_log(miss);
  const double duration = seconds_between(from.time, to.time);
  for (FinalPose& pose : between) {
    const double share = seconds_between(from.time, pose.time) / duration;
    pose.world_from_body = pose.world_from_body * se3_exp(share * whole);
  }
}

}  // namespace

std::vector<FinalPose> final_trajectory(const Map& map, std::span<const AnchoredPose> placed,
                                        const std::map<FrameId, TrackedMotion>& keyframes) {
  std::vector<FinalPose> poses;
  for (const AnchoredPose& pose : placed) {
    if (pose.map != map.id()) continue;
    poses.push_back({pose.frame, pose.time,
                     map.world_from_any(pose.reference) *
                         map.rescale_relative(pose.reference_from_body, pose.units)});
  }
  std::ranges::sort(poses, {}, &FinalPose::time);
  std::size_t from = 0;
  for (std::size_t to = 1; to < poses.size(); ++to) {
    const auto motion = keyframes.find(poses[to].frame);
    if (motion == keyframes.end()) continue;
    if (seconds_between(poses[to - 1].time, poses[to].time) < kFrames &&
        seconds_between(poses[from].time, poses[to].time) < kKeyframes) {
      const SE3 miss = miss_of(map, motion->second, poses[to - 1], poses[to]);
      spread(miss, std::span(poses).subspan(from + 1, to - from - 1), poses[from], poses[to]);
    }
    from = to;
  }
  return poses;
}

}  // namespace rover
