#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "rover/camera/camera.h"
#include "rover/geometry/se3.h"
#include "rover/optimization/reprojection.h"

namespace rover {

// A known point seen in a frame.
struct PoseObservation {
  Eigen::Vector3d point;  // m, world frame
  Eigen::Vector2d pixel;  // px, raw image of `camera`
  int camera = 0;         // of the rig, or kDisparity
  double sigma = 1;       // px, standard deviation per axis
};

struct PoseOptimizationOptions {
  int rounds = 4;          // inliers are chosen anew after each; the first takes all
  int iterations = 10;     // Gauss-Newton steps per round, at most
  double chi2 = 5.991;     // 95% of a squared normalised 2-D residual: beyond is an outlier
  double huber = 2.447;    // sqrt(chi2): scale of the robust kernel, in sigmas
  double min_step = 1e-8;  // stops a round

  void check() const;
};

struct PoseEstimate {
  SE3 world_from_body;
  Matrix6d covariance = Matrix6d::Zero();  // of (translation, rotation), body frame, conditional
                                           // on the map; zero unless converged
  std::vector<char> inliers;               // per observation
  int inlier_count = 0;
  double mean_chi2 = 0;    // of the inliers
  bool converged = false;  // false: fewer than 4 inliers or a singular system; pose as given
};

// Motion-only bundle adjustment by Gauss-Newton (damped where a step fails) with a Huber kernel:
// minimises the reprojection error of fixed points over the pose. Ends early when a round leaves
// the inliers as they were. The covariance is the inverse information of the inliers, scaled up by
// mean chi-square / 2 where that is above 1. Throws InputError for options that make no sense.
PoseEstimate optimize_pose(const Rig& rig, const SE3& world_from_body,
                           std::span<const PoseObservation> observations,
                           const PoseOptimizationOptions& options);

}  // namespace rover
