#include "rover/slam/trajectory_smoothing.h"

#include <algorithm>

#include "rover/imu/imu_buffer.h"
#include "rover/optimization/inertial_smoothing.h"

namespace rover {
namespace {

// Chi-square of the motion between two keyframes (9 degrees of freedom) beyond which it and the map
// are of two minds: one in a million.
constexpr double kContradicting = 45;

// s: over longer intervals tracking knows better, and integrating them for each frame takes long.
constexpr double kLongest = 2;

bool inertial_data_hold(const Keyframe& from, const Keyframe& to) {
  if (to.motion->duration() > kLongest) return false;
  const Vector15d residual = imu_residual(*to.motion, from.state(), to.state(), gravity_of_z_up());
  return residual.head<9>().squaredNorm() < kContradicting;
}

// Two keyframes that follow each other and the readings in between.
class Interval {
 public:
  Interval(const Keyframe& from, const Keyframe& to) : from_(from.state()), to_(to.state()) {
    motion_ = to.motion.get();
    for (const ImuSample& sample : motion_->samples()) readings_.add(sample);
  }

  void smooth(FinalPose& pose, const Matrix6d& tracked) const {
    auto before = readings_.between(motion_->begin(), pose.time);
    auto after = readings_.between(pose.time, motion_->end());
    if (before.empty() || after.empty()) return;
    StatePrior known;
    known.mean = from_;
    known.mean.world_from_body = pose.world_from_body;
    if (!tracked.isZero(0)) known.information.topLeftCorner<6, 6>() = tracked.inverse();
    const auto state = state_between({from_, motion_->over(std::move(before))},
                                     {to_, motion_->over(std::move(after))}, known);
    if (state) pose.world_from_body = state->world_from_body;
  }

 private:
  InertialState from_, to_;
  const Preintegration* motion_ = nullptr;
  ImuBuffer readings_;
};

}  // namespace

void smooth_between_keyframes(const Map& map, std::span<FinalPose> poses,
                              std::span<const Matrix6d> tracked) {
  if (!map.inertial().aligned) return;
  for (const Keyframe& to : map.keyframes()) {
    if (!to.motion || !to.previous.valid()) continue;
    const Keyframe& from = map.at(to.previous);
    auto pose = std::ranges::upper_bound(poses, to.motion->begin(), {}, &FinalPose::time);
    const auto last = std::ranges::lower_bound(poses, to.motion->end(), {}, &FinalPose::time);
    if (pose == last || !inertial_data_hold(from, to)) continue;
    const Interval interval(from, to);
    for (; pose != last; ++pose)
      interval.smooth(*pose, tracked[static_cast<std::size_t>(pose - poses.begin())]);
  }
}

}  // namespace rover
