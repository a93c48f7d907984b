#include "rover/tracking/keyframe_insertion.h"

#include <algorithm>

#include "rover/base/error.h"

namespace rover {

void StereoLandmarkOptions::check() const {
  require(max_baselines > 0, "stereo.max_baselines is {}; use a positive number", max_baselines);
  require(max_relative_sigma > 0, "stereo.max_relative_sigma is {}; use a positive number",
          max_relative_sigma);
}

double near_depth(const Rig& rig, const StereoLandmarkOptions& options) {
  return rig.baseline() * options.max_baselines;
}

bool is_near(const StereoObservation& stereo, double near_depth,
             const StereoLandmarkOptions& options) {
  return stereo.depth < near_depth &&
         stereo.depth_sigma < options.max_relative_sigma * stereo.depth;
}

KeyframeId insert_keyframe(Map& map, Frame frame, const StereoLandmarkOptions& options) {
  const KeyframeId id = map.add_keyframe(std::move(frame));
  const Frame& added = map.at(id).frame;
  if (!added.stereo) return id;
  std::vector<std::pair<float, int>> candidates;  // depth, feature
  int near = 0;
  const double limit = near_depth(map.rig(), options);
  for (int i = 0; i < added.size(); ++i) {
    const StereoObservation* stereo = added.stereo_of(i);
    if (!stereo) continue;
    near += is_near(*stereo, limit, options);
    if (!added[i].landmark.valid()) candidates.emplace_back(stereo->depth, i);
  }
  std::sort(candidates.begin(), candidates.end());
  const SE3 world_from_camera = map.world_from_camera(added);
  const auto stereo_points = added.stereo;
  for (const auto& [depth, feature] : candidates) {
    const StereoObservation& stereo = (*stereo_points)[static_cast<std::size_t>(feature)];
    const bool is_close = is_near(stereo, limit, options);
    if (!is_close && near >= options.min_landmarks) continue;
    if (!is_close) ++near;
    map.add_landmark(world_from_camera * stereo.point.cast<double>(), id, feature);
  }
  return id;
}

}  // namespace rover
