#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "rover/geometry/bearing.h"
#include "rover/geometry/ransac.h"
#include "rover/geometry/se3.h"

namespace rover {

// The unit bearings of one point in two cameras, each in its camera's frame.
struct BearingPair {
  Eigen::Vector3d first;
  Eigen::Vector3d second;
};

// Essential matrices here are E = [t]x R of second_from_first: second^T E first = 0.
Eigen::Matrix3d essential_from_pose(const SE3& second_from_first);

// The four poses second_from_first with a translation of length 1 that share an essential matrix
// (Hartley and Zisserman, 9.6.2).
std::array<SE3, 4> decompose_essential(const Eigen::Matrix3d& essential);

// The squared angle in rad^2, to first order, by which the bearings miss their epipolar planes: the
// Sampson distance on the sphere. For bearings with deviation s on each axis across them it is
// s^2 times a chi-square variable with one degree of freedom.
double epipolar_squared_error(const Eigen::Matrix3d& essential, const BearingPair& pair);

// Gauss-Newton on the epipolar errors of the pairs with these indices; the translation keeps length
// 1. Steps that do not reduce the error are not taken.
SE3 refine_relative_pose(std::span<const BearingPair> pairs, const SE3& second_from_first,
                         const std::vector<int>& indices, int max_iterations = 5);

// RANSAC over OpenGV's five-point solver (Stewenius, Engels, Nister, 2006) with local optimisation.
// Inliers lie within the 95% bound of the epipolar error at this deviation of the bearings in rad.
// Nothing for fewer than five pairs or if no sample has a solution.
std::optional<RansacResult<Eigen::Matrix3d>> estimate_essential(std::span<const BearingPair> pairs,
                                                                double sigma,
                                                                const RansacOptions& options);

}  // namespace rover
