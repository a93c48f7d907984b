#pragma once

#include <span>

#include <Eigen/Core>

#include "rover/camera/camera.h"
#include "rover/geometry/se3.h"

namespace rover {

// A point seen from a known pose.
struct PointObservation {
  SE3 world_from_body;
  Eigen::Vector2d pixel;  // px, raw image of `camera`
  int camera = 0;         // of the rig
  double sigma = 1;       // px, standard deviation per axis
};

struct PointRefinementOptions {
  int iterations = 20;  // Gauss-Newton steps at most

  void check() const;
};

struct PointEstimate {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();       // m, world frame
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // m^2, world frame, conditional on the
                                                         // poses; zero unless converged
  double chi2 = 0;         // sum of the squared normalised residuals: 2 n - 3 degrees of freedom
  double worst_chi2 = 0;   // the largest of them: 2 degrees of freedom
  bool converged = false;  // false: the point is not determined (seen in one direction only, no
                           // parallax, not seen at all); point as given
};

// Refines one point by Gauss-Newton (damped where a step fails) on its reprojection errors, with
// no robust kernel: right after triangulation, where one bad observation condemns the point. A
// point that one of its cameras cannot see has a chi-square of kUnseenChi2 there. Hartley and
// Sturm, "Triangulation" (1997), on why the reprojection error. Throws InputError for options that
// make no sense.
PointEstimate refine_point(const Rig& rig, std::span<const PointObservation> observations,
                           const Eigen::Vector3d& initial,
                           const PointRefinementOptions& options = {});

}  // namespace rover
