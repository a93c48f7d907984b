// The steps of the tracker that inertial data make possible.

#include <algorithm>

#include "rover/map/visibility.h"
#include "rover/tracking/tracker.h"

namespace rover {
namespace {

// How well a velocity is known that two poses tell, m/s.
constexpr double kSeenVelocity = 0.3;

}  // namespace

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
    still_.reset();
    const Eigen::Vector3d velocity = frame.world_from_body.rotation * velocity_.head<3>();
    inertial_->restart(frame.time, frame.world_from_body,
                       velocity_known_ ? velocity : Eigen::Vector3d::Zero(),
                       velocity_known_ ? kSeenVelocity : kUnknownVelocity);
    return;
  }
  const bool seen = state_ == TrackingState::kOk;
  if (seen) {
    still_.see(frame, inertial_->samples(), inertial_->bias());
  } else {
    still_.feel(inertial_->samples(), inertial_->bias());
  }
  note_rest(map);
  inertial_->accept(seen);
  result.inertial = inertial_->state();
  result.inertial_covariance = inertial_->covariance();
  result.drift = inertial_->drift();
}

void Tracker::add_live_pose(TrackingResult& result) {
  const bool felt = result.inertial && given_time_;
  result.live = live_.follow(result, felt ? inertial_->motion_since(*given_time_) : std::nullopt);
  given_time_.reset();
  if (result.inertial) given_time_ = result.anchored.time;
}

// A keyframe made at rest may say so to mapping: rest is recognised only after a while.
void Tracker::note_rest(const Map& map) {
  if (!still_.still()) return;
  const Keyframe& newest = map.at(map.newest_keyframe());
  if (newest.still_sigma > 0 || newest.frame.time < still_.since()) return;
  map_->commit([&](Map& working) { working.set_still(newest.id, options_.still.velocity_sigma); });
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
  add_live_pose(result);
  reckoned_.push_back(result.anchored);
  return true;
}

TrackingResult Tracker::skip(FrameId id, Timestamp time) {
  Frame frame;
  frame.id = id;
  frame.time = time;
  TrackingResult result;
  result.anchored.frame = id;
  result.anchored.time = time;
  result.repeated = true;
  result.state = state_;
  if (state_ == TrackingState::kOk || state_ == TrackingState::kDeadReckoning) {
    const auto view = map_->view();
    follow(*view);
    rebase(*view);
    predicted_ = predict(time);
    if (dead_reckon(*view, frame, result)) return result;
  }
  result.left_out = true;
  return result;
}

// Where the body should be now. One that stood still does so as long as inertial data say nothing
// else.
std::optional<SE3> Tracker::predict_by_inertia(Timestamp time) {
  if (!inertial_) return std::nullopt;
  const auto predicted = inertial_->predict(time);
  if (still_.still_after(inertial_->samples(), inertial_->bias())) {
    inertial_->hold_still(options_.still.velocity_sigma);
  } else {
    inertial_->release();
  }
  return predicted;
}

// After a time without vision the last frame is no guide: the keyframes are asked whose landmarks
// should be in view from where inertial data lead.
bool Tracker::match_to_place(const Map& map, Frame& frame) {
  const SE3 world_from_camera = predicted_ * rig_->body_from_camera[0];
  std::map<KeyframeId, int> in_view;
  for (const Landmark& landmark : map.landmarks()) {
    if (!predict_pixel(landmark, rig_->cameras[0], world_from_camera,
                       options_.search.max_view_angle)) {
      continue;
    }
    for (const auto& [keyframe, feature] : landmark.observations) ++in_view[keyframe];
  }
  std::vector<std::pair<KeyframeId, int>> best(in_view.begin(), in_view.end());
  std::ranges::stable_sort(best, std::greater(), [](const auto& entry) { return entry.second; });
  const auto tries = static_cast<std::size_t>(options_.relocalization.tries_per_frame);
  for (std::size_t i = 0; i < std::min(tries, best.size()); ++i) {
    if (!relocalizer_.locate(map, best[i].first, frame)) continue;
    reference_ = best[i].first;
    return true;
  }
  return false;
}

// Whether vision has been away for so long that the place may be another one.
bool Tracker::is_blind(Timestamp now) const {
  return inertial_ && inertial_->has_prediction() &&
         seconds_between(last_->time, now) > options_.inertial.min_gap;
}

void Tracker::note_gap(const Frame& frame, TrackingResult& result) {
  if (!last_ || !is_blind(frame.time)) return;
  result.gap = VisionGap{last_->time, frame.time, static_cast<int>(reckoned_.size()),
                         predicted_.inverse() * frame.world_from_body};
}

// What was reckoned without vision is corrected once vision is back: half of the frames with the
// keyframe before, half with the one after, so that each follows the nearer when the map moves.
void Tracker::correct_gap(const Map& map, TrackingResult& result) {
  if (reckoned_.empty()) return;
  const auto& states = inertial_->smoothed();
  const Timestamp middle = reckoned_[reckoned_.size() / 2].time;
  for (AnchoredPose& pose : reckoned_) {
    const auto found = std::ranges::find(states, pose.time, &StampedState::time);
    if (found == states.end()) continue;
    const bool first = pose.time < middle;
    pose.reference = first ? map.standing(pose.reference) : reference_;
    pose.reference_from_body =
        map.at(pose.reference).world_from_body().inverse() * found->state.world_from_body;
    pose.units = map.units();
    result.corrected.push_back(pose);
  }
  reckoned_.clear();
}

// Looks at the map as it is when a frame comes.
void Tracker::follow(const Map& map) {
  take_calibration(map);
  inertial_->follow(map);
}

// A calibration that mapping has found holds for what comes: readings, frames, and maps.
void Tracker::take_calibration(const Map& map) {
  const Timestamp offset = map.calibration().time_offset;
  if (offset == inertial_->time_offset() && map.shared_rig() == rig_) return;
  inertial_->set_time_offset(offset);
  rig_ = map.shared_rig();
  initializer_.set_rig(rig_);
  atlas_->set_calibration(rig_, map.calibration());
}

// A new keyframe is linked to the one before, and knows what tracking knows of the state.
void Tracker::enter_inertia(Map& map, KeyframeId id) const {
  if (!inertial_) return;
  inertial_->set_time_offset(map.calibration().time_offset);  // which may be new
  const Keyframe& keyframe = map.at(id);
  map.set_readings_after(inertial_->samples_after(keyframe.frame.time));
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
