#pragma once

#include <optional>
#include <vector>

#include "rover/map/map.h"
#include "rover/optimization/bundle_adjustment.h"

namespace rover {

// How observations of the map are weighted in adjustments.
struct WeightingOptions {
  // px: what a refined place may be off by besides its own noise (calibration, rolling shutter,
  // landmarks that are no points); added in quadrature to its sigma.
  double model_sigma = 0.5;
  // px: the same for places that are not refined. A detector puts a corner somewhere else when the
  // view changes.
  double detection_sigma = 0.5;
  // px: the same for disparities, in place of model_sigma. Of an aligned pair both images show one
  // patch, and hardly differ in what it does not share with the landmark.
  double disparity_sigma = 0.2;

  void check() const;
};

// The standard deviation that an observation enters an adjustment with, px.
double effective_sigma(const Observation& observation, const WeightingOptions& weighting);

// Likewise of a stereo partner's disparity.
double effective_disparity_sigma(double sigma, const WeightingOptions& weighting);

// What a feature measures of the landmark that it is joined to, as adjustments and tracking take
// it: the place in camera 0 and, where the feature has a partner that fits, the disparity.
struct Measurement {
  int camera = 0;         // 0 or kDisparity
  Eigen::Vector2d pixel;  // px
  double sigma = 1;       // px, the effective one
};
struct FeatureMeasurements {
  Measurement place;
  std::optional<Measurement> disparity;
};
FeatureMeasurements measurements_of(const Frame& frame, int feature,
                                    const WeightingOptions& weighting);

// A part of a map as an adjustment problem, with the way back.
struct MapProblem {
  BundleProblem bundle;
  std::vector<KeyframeId> keyframes;  // of each pose
  std::vector<LandmarkId> landmarks;  // of each point
  std::vector<SE3> initial_poses;
  KeyframeId newest;         // of the map when it was gathered
  int epoch = 0;             // likewise
  bool needs_scale = false;  // no fixed pose but the gauge's, and no stereo observation
};

// Gathers the `free` keyframes, all landmarks they see and, as fixed ones, at most `max_fixed` of
// the other keyframes that see these landmarks (those with most of them); `border` are fixed
// besides. With none of these, the oldest free keyframe is fixed instead.
MapProblem gather_problem(const Map& map, const std::vector<KeyframeId>& free, int max_fixed,
                          const WeightingOptions& weighting,
                          const std::vector<KeyframeId>& border = {});

// Every keyframe and landmark; the oldest keyframe is fixed.
MapProblem gather_whole_map(const Map& map, const WeightingOptions& weighting);

// adjust_bundle with the gauge that the problem needs.
BundleSummary adjust(MapProblem& problem, BundleOptions options);

// Writes an adjusted problem back: poses and positions of what is still there; observations that
// turned out as outliers are removed, with landmarks that are left with less than two views.
// Keyframes made since it was gathered, and landmarks only they see, move with their parents, to
// which their distance grows by the factor `scale`.
void commit_adjustment(Map& map, const MapProblem& problem, const BundleSummary& summary,
                       double scale = 1);

// How a keyframe (the index is the pose's) and all that hangs on it have moved: its camera exactly,
// distances by the factor `scale`.
Sim3 motion_of(const MapProblem& problem, std::size_t pose, double scale);

}  // namespace rover
