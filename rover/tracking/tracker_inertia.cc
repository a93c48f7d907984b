// The steps of the tracker that inertial data make possible.

#include <algorithm>

#include "rover/tracking/tracker.h"

namespace rover {

// With a state, its inertial prediction takes part in the pose; else vision is alone.
FramePose Tracker::solve_pose(const Map& map, Frame& frame,
                              const std::vector<TemporaryPoint>& temporary) {
  if (!inertial_ || !inertial_->has_prediction()) {
    return solve_frame_pose(map, options_.pose, options_.weighting, frame, temporary);
  }
  const auto solve = [&](const SE3&, std::span<const PoseObservation> observations) {
    return inertial_->estimate(map.rig(), observations);
  };
  return solve_frame_pose_with(solve, map, options_.weighting, frame, temporary);
}

// In the local map, for a pose to be believed.
int Tracker::needed_inliers() const {
  const bool predicted = inertial_ && inertial_->has_prediction();
  return predicted ? options_.inertial.min_inliers : options_.min_inliers;
}

// Before a map is aligned the gyroscope alone helps.
Eigen::Quaterniond Tracker::predict_rotation(Timestamp time,
                                             const Eigen::Quaterniond& otherwise) const {
  const auto motion = inertial_->motion(last_->time, time, inertial_->bias());
  return motion ? last_->world_from_body.rotation * motion->delta().rotation : otherwise;
}

void Tracker::accept_state(const Frame& frame, const Map& map, TrackingResult& result) {
  if (!inertial_ || !map.inertial().aligned) return;
  if (!inertial_->has_prediction()) {
    inertial_->restart(frame.time, frame.world_from_body);
    return;
  }
  inertial_->accept();
  result.inertial = inertial_->state();
  result.inertial_covariance = inertial_->covariance();
  result.drift = inertial_->drift();
}

// Without vision, inertial data carry the state for a while.
bool Tracker::dead_reckon(const Map& map, const Frame& frame, TrackingResult& result) {
  if (!inertial_ || !inertial_->has_prediction()) return false;
  if (seconds_between(last_->time, frame.time) > options_.inertial.max_dead_reckoning) return false;
  Frame reckoned = frame;
  const PoseEstimate estimate = inertial_->estimate(map.rig(), {});
  if (!estimate.converged) return false;
  reckoned.world_from_body = estimate.world_from_body;
  result.covariance = estimate.covariance;
  result.last_from_body = world_from_given_.inverse() * estimate.world_from_body;
  state_ = TrackingState::kDeadReckoning;
  last_matches_ = 0;
  velocity_known_ = false;
  give(reckoned, map, result);
  accept_state(reckoned, map, result);
  return true;
}

// A new keyframe is linked to the one before, and knows what tracking knows of the state.
void Tracker::enter_inertia(Map& map, KeyframeId id) const {
  if (!inertial_) return;
  const Keyframe& keyframe = map.at(id);
  if (keyframe.previous.valid()) {
    const Keyframe& previous = map.at(keyframe.previous);
    map.set_motion(id, inertial_->motion(previous.frame.time, keyframe.frame.time, previous.bias));
  }
  const auto state = inertial_->state();
  if (!map.inertial().aligned || !state) return;
  map.set_velocity(id, state->velocity, state->bias);
  map.set_covariance(id, inertial_->knowledge());
}

// What the next keyframe's motion may begin with is kept.
void Tracker::forget_samples(Timestamp now) {
  constexpr double kBeforeFirstMap = 20;  // s: older than any frame that may begin a map
  const auto ago = [&](double seconds) {
    return now - static_cast<Timestamp>(seconds * kNanosecondsPerSecond);
  };
  Timestamp needed = ago(kBeforeFirstMap);
  if (map_) {
    const auto view = map_->view();
    needed = std::min(needed, view->at(view->newest_keyframe()).frame.time);
  }
  inertial_->forget_before(std::max(needed, ago(options_.inertial.max_interval)));
}

}  // namespace rover
