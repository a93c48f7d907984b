#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace rover {

// Rotations as unit quaternions. Tangents are rotation vectors in rad.
// Formulas: Solà, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics" (2018).

// The skew-symmetric matrix with skew(a) * b = a x b.
Eigen::Matrix3d skew(const Eigen::Vector3d& v);

// Exponential map, exact to rounding for every rotation vector, zero included.
Eigen::Quaterniond so3_exp(const Eigen::Vector3d& rotation_vector);

// Logarithm, of norm at most pi.
Eigen::Vector3d so3_log(const Eigen::Quaterniond& rotation);

// Right Jacobian: exp(v + d) = exp(v) exp(Jr(v) d) to first order in d; and its inverse.
Eigen::Matrix3d so3_right_jacobian(const Eigen::Vector3d& rotation_vector);
Eigen::Matrix3d so3_right_jacobian_inverse(const Eigen::Vector3d& rotation_vector);

}  // namespace rover
