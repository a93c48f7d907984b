#include "rover/tracking/keyframe_policy.h"

#include <algorithm>
#include <numbers>
#include <unordered_map>

#include "rover/base/error.h"
#include "rover/base/quantile.h"

namespace rover {
namespace {

constexpr double kTolerance = 1e-3;  // s: stamps jitter

// How far the landmarks that both see have moved in the image, apart from what rotation alone does.
double median_parallax(const Map& map, const Frame& frame, const Keyframe& reference) {
  const Camera& camera = map.rig().cameras[0];
  const SE3 now = map.world_from_camera(frame), then = map.world_from_camera(reference.frame);
  std::vector<double> motions;
  for (const Observation& observation : frame.observations) {
    const Landmark* landmark = map.find(observation.landmark);
    if (!landmark || !landmark->has_observation(reference.id)) continue;
    const Eigen::Vector3d ray_then = landmark->position - then.translation;
    const auto rotated = camera.project(now.rotation.conjugate() * ray_then);
    if (rotated) motions.push_back((*rotated - observation.pixel.cast<double>()).norm());
  }
  return median(std::move(motions));
}

// Landmarks of a keyframe that other keyframes confirm; in a map of two keyframes, all.
int established_landmarks(const Map& map, const Keyframe& keyframe) {
  const std::size_t wanted = std::min<std::size_t>(3, map.keyframes().size());
  int count = 0;
  for (const Observation& observation : keyframe.frame.observations) {
    const Landmark* landmark = map.find(observation.landmark);
    count += landmark && landmark->observations.size() >= wanted;
  }
  return count;
}

// Hovering where the reference keyframe was: another one would see the same, and push those with
// parallax out of the window.
bool is_staying(const KeyframeEvidence& evidence, const KeyframePolicyOptions& options) {
  return evidence.inertial && evidence.parallax <= options.moving_parallax &&
         evidence.rotation <= options.moving_rotation;
}

// Where few landmarks are tracked; inertial data carry the pose on meanwhile.
bool is_hasty(const KeyframeEvidence& evidence, const KeyframePolicyOptions& options) {
  return evidence.settled && evidence.inliers < options.min_landmarks &&
         evidence.seconds_since_keyframe < options.sparse_gap - kTolerance;
}

// Inertial data say less the longer they are integrated.
double longest_gap(const KeyframeEvidence& evidence, const KeyframePolicyOptions& options) {
  if (!evidence.settled) return options.short_gap;
  if (evidence.inliers < options.sparse_landmarks) return options.sparse_gap;
  return evidence.stereo ? options.max_gap : options.short_gap;
}

bool is_due(const KeyframeEvidence& evidence, const KeyframePolicyOptions& options) {
  return evidence.inertial &&
         evidence.seconds_since_keyframe > longest_gap(evidence, options) - kTolerance;
}

}  // namespace

void KeyframePolicyOptions::check() const {
  require(min_tracked_share > 0 && min_tracked_share < 1,
          "keyframe.min_tracked_share is {}; use a share between 0 and 1", min_tracked_share);
  require(max_parallax > 0 && max_rotation > 0,
          "keyframe.max_parallax and max_rotation must be positive");
  require(sparse_gap >= 0 && short_gap > 0 && max_gap >= short_gap,
          "keyframe.short_gap must be positive and at most max_gap, sparse_gap not negative");
  require(min_inliers >= 4, "keyframe.min_inliers is {}; use 4 or more", min_inliers);
}

bool wants_keyframe(const KeyframeEvidence& evidence, const KeyframePolicyOptions& options) {
  if (evidence.inliers < options.min_inliers || evidence.still) return false;
  if (is_hasty(evidence, options)) return false;
  const bool needs_near = evidence.stereo && evidence.near_tracked < options.min_near &&
                          evidence.near_new > options.min_new_near;
  const bool fading = evidence.inliers < options.min_landmarks &&
                      evidence.inliers < 0.9 * evidence.reference_landmarks;
  if (fading) return true;
  if (is_staying(evidence, options)) return false;
  if (needs_near || is_due(evidence, options)) return true;
  if (evidence.frames_since_keyframe < options.min_gap) return false;
  return evidence.inliers < options.min_tracked_share * evidence.reference_landmarks ||
         evidence.parallax > options.max_parallax || evidence.rotation > options.max_rotation;
}

KeyframeEvidence gather_keyframe_evidence(const Map& map, const Frame& frame,
                                          KeyframeId reference_id, double near_depth) {
  const Keyframe& reference = map.at(reference_id);
  KeyframeEvidence evidence;
  evidence.inliers = frame.landmark_count();
  evidence.reference_landmarks = established_landmarks(map, reference);
  evidence.parallax = median_parallax(map, frame, reference);
  const SE3& then = reference.world_from_body();
  evidence.rotation =
      then.rotation.angularDistance(frame.world_from_body.rotation) * 180 / std::numbers::pi;
  evidence.stereo = frame.stereo != nullptr;
  for (int i = 0; i < frame.size(); ++i) {
    const StereoObservation* stereo = frame.stereo_of(i);
    if (!stereo || stereo->depth > near_depth) continue;
    (frame[i].landmark.valid() ? evidence.near_tracked : evidence.near_new) += 1;
  }
  return evidence;
}

}  // namespace rover
