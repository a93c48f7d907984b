#pragma once

#include <optional>
#include <span>
#include <vector>

#include "rover/geometry/essential.h"

namespace rover {

// Homographies map bearings: second ~ H first, with a positive factor.

// The squared angle in rad^2, to first order, by which a pair must be moved to fit the homography
// (Sampson): for bearings with deviation s on each axis across them, s^2 times a chi-square
// variable with two degrees of freedom. Infinite for a point that H moves behind the camera.
double homography_squared_error(const Eigen::Matrix3d& homography, const BearingPair& pair);

// The homography of four or more pairs that minimises algebraic errors (direct linear transform on
// the sphere). Nothing if the pairs do not determine one, or disagree which side they see.
std::optional<Eigen::Matrix3d> solve_homography(std::span<const BearingPair> pairs);

// Gauss-Newton on the errors of the pairs with these indices.
Eigen::Matrix3d refine_homography(std::span<const BearingPair> pairs,
                                  const Eigen::Matrix3d& homography,
                                  const std::vector<int>& indices, int max_iterations = 5);

// RANSAC over four-pair samples with local optimisation. Inliers lie within the 95% bound of the
// error at this deviation of the bearings in rad. Nothing for fewer than four pairs or if no sample
// has a solution.
std::optional<RansacResult<Eigen::Matrix3d>> estimate_homography(std::span<const BearingPair> pairs,
                                                                 double sigma,
                                                                 const RansacOptions& options);

// The poses second_from_first, with a translation of length 1, whose plane makes this homography:
// four, or none where it is a rotation and shows no translation (Ma, Soatto, Kosecka, Sastry, "An
// invitation to 3-D vision", 2004, section 5.3.3).
std::vector<SE3> decompose_homography(const Eigen::Matrix3d& homography);

}  // namespace rover
