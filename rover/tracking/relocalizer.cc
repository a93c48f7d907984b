#include "rover/tracking/relocalizer.h"

#include <numeric>

#include "rover/base/error.h"
#include "rover/base/random.h"
#include "rover/geometry/absolute_pose.h"
#include "rover/map/feature_choice.h"
#include "rover/matching/partial_matching.h"

namespace rover {

void RelocalizationOptions::check() const {
  require(min_matches >= 4 && min_inliers >= 4,
          "relocalization.min_matches and min_inliers must be at least 4");
  require(matched_share > 0 && matched_share <= 1,
          "relocalization.matched_share is {}; use a share up to 1", matched_share);
  require(ransac_sigma > 0, "relocalization.ransac_sigma is {}; use a positive number",
          ransac_sigma);
  require(recent_keyframes > 0 && tries_per_frame > 0,
          "relocalization.recent_keyframes and tries_per_frame must be positive");
}

void clear_landmarks(Frame& frame) {
  for (int i = 0; i < frame.size(); ++i) frame.unjoin(i);
}

std::vector<Match> match_known(const Matcher& matcher, const Frame& known, const Frame& frame,
                               double share) {
  std::vector<int> all(static_cast<std::size_t>(frame.size()));
  std::iota(all.begin(), all.end(), 0);
  return match_some(matcher, {*known.features, &known.image},
                    choose_features(known, share, Prefer::kWithLandmark),
                    {*frame.features, &frame.image}, all);
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
  const auto matches = match_known(*matcher_, known, frame, options_.matched_share);
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
    if (!is_inlier[i]) frame.unjoin(features[i]);
  }
  return true;
}

}  // namespace rover
