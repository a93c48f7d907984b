#include "rover/tracking/relocalizer.h"

#include <algorithm>

#include "rover/base/error.h"
#include "rover/base/random.h"
#include "rover/geometry/absolute_pose.h"

namespace rover {

void RelocalizationOptions::check() const {
  require(min_matches >= 4 && min_inliers >= 4,
          "relocalization.min_matches and min_inliers must be at least 4");
  require(ransac_sigma > 0, "relocalization.ransac_sigma is {}; use a positive number",
          ransac_sigma);
  require(recent_keyframes > 0 && tries_per_frame > 0,
          "relocalization.recent_keyframes and tries_per_frame must be positive");
}

void clear_landmarks(Frame& frame) {
  for (Observation& observation : frame.observations) observation.landmark = {};
}

int transfer_landmarks(const Frame& known, const std::vector<Match>& matches, Frame& frame) {
  int joined = 0;
  for (const Match& match : matches) {
    const LandmarkId landmark = known[match.a].landmark;
    if (!landmark.valid()) continue;
    frame[match.b].landmark = landmark;
    ++joined;
  }
  return joined;
}

Relocalizer::Relocalizer(std::shared_ptr<const Matcher> matcher,
                         const RelocalizationOptions& options, const PoseOptimizationOptions& pose,
                         const WeightingOptions& weighting, std::uint64_t seed)
    : matcher_(std::move(matcher)),
      options_(options),
      pose_(pose),
      weighting_(weighting),
      seed_(seed) {
  options_.check();
}

bool Relocalizer::locate(const Map& map, KeyframeId keyframe, Frame& frame) const {
  const SE3 before = frame.world_from_body;
  clear_landmarks(frame);
  const Frame& known = map.at(keyframe).frame;
  const auto matches =
      matcher_->match({*known.features, &known.image}, {*frame.features, &frame.image});
  if (transfer_landmarks(known, matches, frame) >= options_.min_matches &&
      solve_absolute_pose(map, frame) &&
      solve_frame_pose(map, pose_, weighting_, frame).landmarks >= options_.min_inliers) {
    return true;
  }
  clear_landmarks(frame);
  frame.world_from_body = before;
  return false;
}

bool Relocalizer::solve_absolute_pose(const Map& map, Frame& frame) const {
  const Camera& camera = map.rig().cameras[0];
  std::vector<PointBearing> pairs;
  std::vector<int> features;
  for (int i = 0; i < frame.size(); ++i) {
    const Landmark* landmark = map.find(frame[i].landmark);
    if (!landmark) continue;
    const auto ray = camera.unproject(frame[i].pixel.cast<double>());
    if (!ray) continue;
    pairs.push_back({landmark->position, *ray, 0});
    features.push_back(i);
  }
  AbsolutePoseOptions options;
  options.sigma_px = options_.ransac_sigma;
  options.focal_length = camera.focal_length();
  options.min_inliers = options_.min_inliers;
  options.ransac.seed = hash_seed(seed_, static_cast<std::uint64_t>(frame.id.value));
  const auto pose = estimate_absolute_pose(pairs, map.rig().body_from_camera, options);
  if (!pose) return false;
  frame.world_from_body = pose->world_from_body;
  std::vector<char> is_inlier(features.size());
  for (const int i : pose->inliers) is_inlier[static_cast<std::size_t>(i)] = 1;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (!is_inlier[i]) frame[features[i]].landmark = {};
  }
  return true;
}

}  // namespace rover
