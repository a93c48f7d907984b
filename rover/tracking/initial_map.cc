#include "rover/tracking/initial_map.h"

#include <algorithm>

#include "rover/base/quantile.h"
#include "rover/tracking/landmark_search.h"

namespace rover {
namespace {

double median_depth(const Map& map) {
  std::vector<double> depths;
  const SE3 camera_from_world = map.camera_from_world((*map.keyframes().begin()).frame);
  for (const Landmark& landmark : map.landmarks()) {
    depths.push_back((camera_from_world * landmark.position).norm());
  }
  return median(std::move(depths));
}

void adjust_views(Map& map, const WeightingOptions& weighting, const BundleOptions& options) {
  MapProblem problem = gather_whole_map(map, weighting);
  const BundleSummary summary = adjust(problem, options);
  commit_adjustment(map, problem, summary);
}

}  // namespace

KeyframeId build_initial_map(Map& map, InitialViews views, int min_landmarks,
                             const PatchRefinementOptions& refinement,
                             const WeightingOptions& weighting, const BundleOptions& adjustment) {
  const KeyframeId first = map.add_keyframe(std::move(views.first));
  for (const auto& point : views.points) {
    const LandmarkId landmark = map.add_landmark(point.position, first, point.first);
    views.second[point.second].landmark = landmark;
  }
  refine_observations(map, refinement, views.second);
  const KeyframeId second = map.add_keyframe(std::move(views.second));
  adjust_views(map, weighting, adjustment);
  if (static_cast<int>(map.landmarks().size()) < min_landmarks) return {};
  Sim3 rescale;
  rescale.scale = 1 / median_depth(map);
  map.transform(rescale);
  return second;
}

}  // namespace rover
