#include "rover/mapping/reprojection_check.h"

#include <limits>

#include "rover/map/appearance.h"

namespace rover {

double reprojection_chi2(const Map& map, const Eigen::Vector3d& point, KeyframeId keyframe,
                         int feature, const WeightingOptions& weighting) {
  const Frame& frame = map.at(keyframe).frame;
  const auto pixel = map.rig().cameras[0].project(map.camera_from_world(frame) * point);
  if (!pixel) return std::numeric_limits<double>::infinity();
  const Observation& observation = frame[feature];
  const double sigma = effective_sigma(observation, weighting);
  return (*pixel - observation.pixel.cast<double>()).squaredNorm() / (sigma * sigma);
}

bool fits_observations(const Map& map, const Eigen::Vector3d& point, const Landmark& other,
                       const WeightingOptions& weighting, double chi2) {
  for (const auto& [keyframe, feature] : other.observations) {
    if (reprojection_chi2(map, point, keyframe, feature, weighting) > chi2) return false;
  }
  return true;
}

namespace {

void refine_joined(Map& map, LandmarkId landmark, KeyframeId keyframe, int feature,
                   const PatchRefinementOptions& refinement) {
  const Frame& frame = map.at(keyframe).frame;
  Observation observation = frame[feature];
  if (refine_observation(map.at(landmark), map.rig().cameras[0], map.camera_from_world(frame),
                         frame.image, refinement, observation)) {
    map.set_measurement(keyframe, feature, observation.pixel, observation.sigma);
  }
}

}  // namespace

bool observe_refined(Map& map, LandmarkId landmark, KeyframeId keyframe, int feature,
                     const PatchRefinementOptions& refinement) {
  if (!map.observe(landmark, keyframe, feature)) return false;
  refine_joined(map, landmark, keyframe, feature, refinement);
  return true;
}

bool fuse_checked(Map& map, LandmarkId a, LandmarkId b, const LandmarkCreationOptions& options) {
  const Landmark* kept = map.find(a);
  const Landmark* gone = map.find(b);
  if (!kept || !gone || a == b) return false;
  if (kept->observations.size() < gone->observations.size()) std::swap(kept, gone);
  if (!fits_observations(map, kept->position, *gone, options.weighting, options.chi2)) {
    return false;
  }
  const LandmarkId id = kept->id;
  const auto moved = gone->observations;
  map.fuse(gone->id, id);
  for (const auto& [keyframe, feature] : moved) {
    if (map.at(keyframe).frame[feature].landmark == id) {
      refine_joined(map, id, keyframe, feature, options.refinement);
    }
  }
  return true;
}

}  // namespace rover
