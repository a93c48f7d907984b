#include "rover/slam/final_trajectory.h"

#include <algorithm>

#include "rover/slam/trajectory_smoothing.h"

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

std::vector<const PlacedFrame*> in_time_order(MapId map, std::span<const PlacedFrame> placed) {
  std::vector<const PlacedFrame*> frames;
  for (const PlacedFrame& frame : placed) {
    if (frame.anchored.map == map) frames.push_back(&frame);
  }
  std::ranges::sort(frames, {}, [](const PlacedFrame* frame) { return frame->anchored.time; });
  return frames;
}

FinalPose through_map(const Map& map, const AnchoredPose& pose) {
  return {pose.frame, pose.time,
          map.world_from_any(pose.reference) *
              map.rescale_relative(pose.reference_from_body, pose.units)};
}

Matrix6d rescaled(Matrix6d covariance, double factor) {
  covariance.topRows<3>() *= factor;
  covariance.leftCols<3>() *= factor;
  return covariance;
}

void spread_misses(const Map& map, const std::map<FrameId, TrackedMotion>& keyframes,
                   std::span<FinalPose> poses) {
  std::size_t from = 0;
  for (std::size_t to = 1; to < poses.size(); ++to) {
    const auto motion = keyframes.find(poses[to].frame);
    if (motion == keyframes.end()) continue;
    if (seconds_between(poses[to - 1].time, poses[to].time) < kFrames &&
        seconds_between(poses[from].time, poses[to].time) < kKeyframes) {
      const SE3 miss = miss_of(map, motion->second, poses[to - 1], poses[to]);
      spread(miss, poses.subspan(from + 1, to - from - 1), poses[from], poses[to]);
    }
    from = to;
  }
}

}  // namespace

std::vector<FinalPose> final_trajectory(const Map& map, std::span<const PlacedFrame> placed,
                                        const std::map<FrameId, TrackedMotion>& keyframes) {
  std::vector<FinalPose> poses;
  std::vector<Matrix6d> covariances;
  for (const PlacedFrame* frame : in_time_order(map.id(), placed)) {
    poses.push_back(through_map(map, frame->anchored));
    covariances.push_back(rescaled(frame->covariance, map.scale() / frame->anchored.units.scale));
  }
  spread_misses(map, keyframes, poses);
  smooth_between_keyframes(map, poses, covariances);
  return poses;
}

}  // namespace rover
