#pragma once

#include <optional>
#include <span>
#include <vector>

#include "rover/geometry/ransac.h"
#include "rover/geometry/se3.h"

namespace rover {

// A known point in the world and the unit bearing at which one of a rig's cameras sees it.
struct PointBearing {
  Eigen::Vector3d point;    // m, in the world
  Eigen::Vector3d bearing;  // unit, in the frame of its camera
  int camera = 0;
};

struct AbsolutePoseOptions {
  RansacOptions ransac = {};
  double sigma_px = 1.0;        // deviation of an observation on each image axis
  double focal_length = 450.0;  // px: turns pixels into angles at the image centre
  int min_inliers = 10;         // at least 4

  double sigma() const { return sigma_px / focal_length; }  // rad
  // Throws InputError for values that make no sense.
  void check() const;
};

struct AbsolutePose {
  SE3 world_from_body;
  std::vector<int> inliers;  // ascending indices
  int iterations = 0;
};

// The pose of a rig that sees known points: RANSAC over OpenGV's P3P (Kneip, Scaramuzza, Siegwart,
// "A novel parametrization of the P3P problem", 2011), each minimal sample from one camera, each
// hypothesis judged by the bearings of all cameras, local optimisation of the best. Inliers lie
// within the 95% bound of the angular error (chi-square, two degrees of freedom).
//
// Nothing if no camera has three correspondences, if the points do not determine a pose (collinear
// samples), or if fewer than min_inliers agree. Reproducible by options.ransac.seed.
std::optional<AbsolutePose> estimate_absolute_pose(std::span<const PointBearing> correspondences,
                                                   std::span<const SE3> body_from_camera,
                                                   const AbsolutePoseOptions& options = {});

// The same for a single camera whose frame is the body's.
std::optional<AbsolutePose> estimate_absolute_pose(std::span<const PointBearing> correspondences,
                                                   const AbsolutePoseOptions& options = {});

// Gauss-Newton on the angular errors of the correspondences with these indices, from a pose nearby.
// Steps that do not reduce the error are not taken.
SE3 refine_absolute_pose(std::span<const PointBearing> correspondences,
                         std::span<const SE3> body_from_camera, const SE3& world_from_body,
                         const std::vector<int>& indices, int max_iterations = 5);

}  // namespace rover
