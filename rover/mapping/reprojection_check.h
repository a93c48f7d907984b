#pragma once

#include "rover/map/map.h"
#include "rover/mapping/triangulator.h"

namespace rover {

// Squared reprojection error of a point in a keyframe's feature, normalised by the feature's
// uncertainty; infinite if the point cannot be seen. 2 degrees of freedom.
double reprojection_chi2(const Map& map, const Eigen::Vector3d& point, KeyframeId keyframe,
                         int feature, const WeightingOptions& weighting);

// Whether one landmark can stand for another: it fits all keyframes that see the other.
bool fits_observations(const Map& map, const Eigen::Vector3d& point, const Landmark& other,
                       const WeightingOptions& weighting, double chi2);

// Joins a landmark to a keyframe's feature, refined photometrically where the image is at hand.
bool observe_refined(Map& map, LandmarkId landmark, KeyframeId keyframe, int feature,
                     const PatchRefinementOptions& refinement);

// Fuses two landmarks into the one seen more often, if it fits the other's observations; these are
// refined anew, where images are at hand.
bool fuse_checked(Map& map, LandmarkId a, LandmarkId b, const LandmarkCreationOptions& options);

}  // namespace rover
