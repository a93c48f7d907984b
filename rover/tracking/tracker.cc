#include "rover/tracking/tracker.h"

#include <algorithm>

#include "rover/base/error.h"
#include "rover/base/random.h"

namespace rover {
namespace {

constexpr double kReferenceWidth = 640;
constexpr std::size_t kYoungMap = 5;  // keyframes
enum Purpose : std::uint64_t { kRelocalization = 1, kInitialization = 2 };

}  // namespace

const char* to_string(TrackingState state) {
  switch (state) {
    case TrackingState::kWaiting:
      return "waiting";
    case TrackingState::kOk:
      return "ok";
    case TrackingState::kDeadReckoning:
      return "dead-reckoning";
    case TrackingState::kLost:
      return "lost";
  }
  return "";
}

void TrackerOptions::check() const {
  require(motion_radius > 0 && local_radius > 0,
          "tracking.motion_radius and local_radius must be positive");
  require(min_inliers >= 4 && confident_inliers >= min_inliers,
          "tracking.min_inliers must be at least 4 and at most confident_inliers");
  search.check();
  refinement.check();
  pose.check();
  weighting.check();
  local_map.check();
  keyframe.check();
  stereo.check();
  relocalization.check();
  initialization.check();
  initial_adjustment.check();
  inertial.check();
  still.check();
  live.check();
}

Tracker::Tracker(std::shared_ptr<Atlas> atlas, std::shared_ptr<const Rig> rig,
                 const FeatureFamily& family, const TrackerOptions& options, std::uint64_t seed,
                 const std::optional<ImuCalibration>& imu)
    : atlas_(std::move(atlas)),
      rig_(std::move(rig)),
      family_(family),
      options_(options),
      pixel_scale_(rig_->cameras[0].width() / kReferenceWidth),
      relocalizer_(family.matcher, options.relocalization, options.pose, options.weighting,
                   hash_seed(seed, kRelocalization)),
      initializer_(rig_, family.matcher, options.initialization, hash_seed(seed, kInitialization)),
      still_(options.still, rig_->cameras[0].width()),
      live_(options.live) {
  options_.check();
  if (imu) inertial_ = std::make_unique<InertialTracking>(*imu, options_.inertial);
}

TrackingResult Tracker::track(Frame frame) {
  TrackingResult result;
  result.anchored.frame = frame.id;
  result.anchored.time = frame.time;
  result.features = frame.size();
  const auto view = map_ ? map_->view() : nullptr;
  const FeatureGrid grid(*frame.features);
  StageTimer timer(result.times);
  const bool located = view && locate(*view, grid, frame);
  timer.done("match");
  if (located && track_local_map(*view, grid, frame, result)) {
    timer.done("local_map");
    accept(frame, *view, result);
    decide_keyframe(*view, frame, result);
    correct_gap(*map_->view(), result);
    timer.done("keyframe");
  } else {
    lose(frame, result);
    if (may_begin_map(view.get(), frame.time)) begin_map(std::move(frame), result);
    timer.done("begin_map");
  }
  if (inertial_) forget_samples(result.anchored.time);
  return result;
}

// Finds a frame roughly: from the last one while that is known, else anywhere near.
bool Tracker::locate(const Map& map, const FeatureGrid& grid, Frame& frame) {
  if (inertial_) follow(map);
  if (state_ != TrackingState::kOk && state_ != TrackingState::kDeadReckoning) {
    return relocalize(map, frame);
  }
  rebase(map);
  predicted_ = frame.world_from_body = predict(frame.time);
  if (frame.size() < needed_inliers()) return false;
  return match_to_last(map, grid, frame) || match_to_reference(map, frame) ||
         (is_blind(frame.time) && match_to_place(map, frame)) ||
         (state_ == TrackingState::kDeadReckoning && relocalize(map, frame));
}

void Tracker::rebase(const Map& map) {
  const SE3 world_from_reference = map.world_from_any(reference_);
  last_->world_from_body =
      world_from_reference * map.rescale_relative(reference_from_last_, units_);
  world_from_given_ = world_from_reference * map.rescale_relative(reference_from_given_, units_);
  reference_ = map.standing(reference_);
  const SE3 reference_from_world = map.at(reference_).world_from_body().inverse();
  reference_from_last_ = reference_from_world * last_->world_from_body;
  reference_from_given_ = reference_from_world * world_from_given_;
  units_ = map.units();
}

SE3 Tracker::predict(Timestamp time) {
  if (const auto predicted = predict_by_inertia(time)) return *predicted;
  if (!velocity_known_) return last_->world_from_body;
  SE3 predicted = last_->world_from_body * se3_exp(velocity_ * seconds_between(last_->time, time));
  if (inertial_) predicted.rotation = predict_rotation(time, predicted.rotation);
  return predicted;
}

AnchoredPose Tracker::anchor(const Map& map, const Frame& frame, KeyframeId reference) const {
  const SE3& world_from_reference = map.at(reference).world_from_body();
  return {frame.id,
          frame.time,
          map.id(),
          reference,
          world_from_reference.inverse() * frame.world_from_body,
          map.units()};
}

void Tracker::accept(const Frame& frame, const Map& map, TrackingResult& result) {
  velocity_known_ = state_ == TrackingState::kOk && last_;
  if (velocity_known_) {
    velocity_ = se3_log(last_->world_from_body.inverse() * frame.world_from_body) /
                seconds_between(last_->time, frame.time);
  }
  result.last_from_body = motion_since_given(frame);
  note_gap(frame, result);
  state_ = TrackingState::kOk;
  give(frame, map, result);
  accept_state(frame, map, result);
  add_live_pose(result);
  reference_from_last_ = result.anchored.reference_from_body;
  last_ = frame;
  last_matches_ = result.inliers;
  initializer_.reset();
  ++frames_since_keyframe_;
}

// What odometry says. After a time without vision, what vision corrects is no motion.
SE3 Tracker::motion_since_given(const Frame& frame) const {
  const bool known = state_ == TrackingState::kOk || state_ == TrackingState::kDeadReckoning;
  if (!known || !last_) return {};
  return world_from_given_.inverse() * (is_blind(frame.time) ? predicted_ : frame.world_from_body);
}

void Tracker::give(const Frame& frame, const Map& map, TrackingResult& result) {
  result.state = state_;
  result.epoch = map.epoch();
  result.world_from_body = frame.world_from_body;
  result.anchored = anchor(map, frame, reference_);
  result.metric = !inertial_ || map.inertial().aligned;
  reference_from_given_ = result.anchored.reference_from_body;
  units_ = map.units();
}

void Tracker::lose(const Frame& frame, TrackingResult& result) {
  if (map_ && dead_reckon(*map_->view(), frame, result)) return;
  if (state_ == TrackingState::kOk || state_ == TrackingState::kDeadReckoning) {
    state_ = TrackingState::kLost;
    if (inertial_) inertial_->forget();
    reckoned_.clear();
    still_.reset();
    live_.interrupt();
    given_time_.reset();
    lost_since_ = frame.time;
    relocalization_turn_ = 0;
  }
  last_matches_ = 0;
  velocity_known_ = false;
  result.state = state_;
  if (map_) result.anchored.map = map_->view()->id();
}

bool Tracker::may_begin_map(const Map* map, Timestamp now) const {
  if (!map) return true;
  if (state_ == TrackingState::kDeadReckoning) return false;
  const bool young = map->keyframes().size() < kYoungMap;
  return seconds_between(lost_since_, now) >= (young ? options_.max_lost_young : options_.max_lost);
}

// The pose of a tracked frame in its map as it is by now: mapping may have moved it meanwhile.
SE3 Tracker::pose_in(const Map& map, const Frame& frame, const TrackingResult& result) const {
  if (map.epoch() == result.epoch) return frame.world_from_body;
  const AnchoredPose& pose = result.anchored;
  return map.world_from_any(pose.reference) *
         map.rescale_relative(pose.reference_from_body, pose.units);
}

void Tracker::decide_keyframe(const Map& map, const Frame& frame, TrackingResult& result) {
  const double near = near_depth(*rig_, options_.stereo);
  KeyframeEvidence evidence = gather_keyframe_evidence(map, frame, reference_, near);
  evidence.frames_since_keyframe = frames_since_keyframe_;
  evidence.inertial = inertial_ != nullptr;
  evidence.settled = map.inertial().scale_settled;
  evidence.still = still_.still();
  evidence.seconds_since_keyframe =
      seconds_between(map.at(map.newest_keyframe()).frame.time, frame.time);
  if (!wants_keyframe(evidence, options_.keyframe)) return;
  result.new_keyframe = map_->commit([&](Map& working) {
    for (const auto& [landmark, counts] : sightings_) {
      working.count_sighting(landmark, counts.first, counts.second);
    }
    Frame placed = frame;
    placed.world_from_body = pose_in(working, frame, result);
    const KeyframeId keyframe = insert_keyframe(working, std::move(placed), options_.stereo);
    enter_inertia(working, keyframe);
    return keyframe;
  });
  sightings_.clear();
  frames_since_keyframe_ = 0;
  const auto view = map_->view();
  reference_ = result.new_keyframe;
  reference_from_last_ = reference_from_given_ = SE3();
  result.anchored = anchor(*view, view->at(reference_).frame, reference_);
  last_->observations = view->at(reference_).frame.observations;
}

}  // namespace rover
