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
}

Tracker::Tracker(std::shared_ptr<Atlas> atlas, std::shared_ptr<const Rig> rig,
                 const FeatureFamily& family, const TrackerOptions& options, std::uint64_t seed)
    : atlas_(std::move(atlas)),
      rig_(std::move(rig)),
      family_(family),
      options_(options),
      pixel_scale_(rig_->cameras[0].width() / kReferenceWidth),
      relocalizer_(family.matcher, options.relocalization, options.pose, options.weighting,
                   hash_seed(seed, kRelocalization)),
      initializer_(rig_, family.matcher, options.initialization, hash_seed(seed, kInitialization)) {
  options_.check();
}

TrackingResult Tracker::track(Frame frame) {
  TrackingResult result;
  result.anchored.frame = frame.id;
  result.anchored.time = frame.time;
  result.features = frame.size();
  const auto view = map_ ? map_->view() : nullptr;
  const FeatureGrid grid(*frame.features);
  StageTimer timer(result.times);
  bool located = false;
  if (state_ == TrackingState::kOk) {
    rebase(*view);
    frame.world_from_body = predict(frame.time);
    located = match_to_last(*view, grid, frame) || match_to_reference(*view, frame);
  } else if (view) {
    located = relocalize(*view, frame);
  }
  timer.done("match");
  if (located && track_local_map(*view, grid, frame, result)) {
    timer.done("local_map");
    accept(frame, *view, result);
    decide_keyframe(*view, frame, result);
    timer.done("keyframe");
  } else {
    lose(frame, result);
    if (may_begin_map(view.get(), frame.time)) begin_map(std::move(frame), result);
    timer.done("begin_map");
  }
  return result;
}

void Tracker::rebase(const Map& map) {
  last_->world_from_body = map.world_from_any(reference_) * reference_from_last_;
  reference_ = map.standing(reference_);
}

SE3 Tracker::predict(Timestamp time) const {
  if (!velocity_known_) return last_->world_from_body;
  return last_->world_from_body * se3_exp(velocity_ * seconds_between(last_->time, time));
}

AnchoredPose Tracker::anchor(const Map& map, const Frame& frame, KeyframeId reference) const {
  const SE3& world_from_reference = map.at(reference).world_from_body();
  return {frame.id, frame.time, map.id(), reference,
          world_from_reference.inverse() * frame.world_from_body};
}

void Tracker::accept(const Frame& frame, const Map& map, TrackingResult& result) {
  velocity_known_ = state_ == TrackingState::kOk && last_;
  if (velocity_known_) {
    result.last_from_body = last_->world_from_body.inverse() * frame.world_from_body;
    velocity_ = se3_log(result.last_from_body) / seconds_between(last_->time, frame.time);
  }
  state_ = TrackingState::kOk;
  result.state = state_;
  result.epoch = map.epoch();
  result.world_from_body = frame.world_from_body;
  result.anchored = anchor(map, frame, reference_);
  reference_from_last_ = result.anchored.reference_from_body;
  last_ = frame;
  last_matches_ = result.inliers;
  initializer_.reset();
  ++frames_since_keyframe_;
}

void Tracker::lose(const Frame& frame, TrackingResult& result) {
  if (state_ == TrackingState::kOk) {
    state_ = TrackingState::kLost;
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
  const bool young = map->keyframes().size() < kYoungMap;
  return seconds_between(lost_since_, now) >= (young ? options_.max_lost_young : options_.max_lost);
}

void Tracker::decide_keyframe(const Map& map, const Frame& frame, TrackingResult& result) {
  const double near = near_depth(*rig_, options_.stereo);
  KeyframeEvidence evidence = gather_keyframe_evidence(map, frame, reference_, near);
  evidence.frames_since_keyframe = frames_since_keyframe_;
  if (!wants_keyframe(evidence, options_.keyframe)) return;
  result.new_keyframe = map_->commit([&](Map& working) {
    for (const auto& [landmark, counts] : sightings_) {
      working.count_sighting(landmark, counts.first, counts.second);
    }
    return insert_keyframe(working, frame, options_.stereo);
  });
  sightings_.clear();
  frames_since_keyframe_ = 0;
  const auto view = map_->view();
  reference_ = result.new_keyframe;
  reference_from_last_ = SE3();
  result.anchored = anchor(*view, frame, reference_);
  last_->observations = view->at(reference_).frame.observations;
}

}  // namespace rover
