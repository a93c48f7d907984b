#pragma once

#include "rover/optimization/bundle_adjustment.h"

namespace rover {

// The constraint that removes the free scale of a monocular problem: one free pose keeps its
// distance to a fixed one, so its translation moves on a sphere.
struct ScaleGauge {
  int pose = -1;                                     // -1: nothing is held
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();  // m, world: centre of the sphere
  double distance = 0;                               // m

  // The farthest free pose from the first fixed one, as in the options; holds nothing if
  // `fix_scale` is off or if poses fixed in two different places hold the scale already.
  static ScaleGauge of(const BundleProblem& problem, const BundleOptions& options);

  // The tangent of se3_plus along which the pose must not move (unit length).
  Vector6d held_direction(const SE3& world_from_body) const;
  // The pose, moved back to the sphere.
  SE3 restored(const SE3& world_from_body) const;
};

}  // namespace rover
