#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "rover/geometry/so3.h"

namespace rover {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// A rigid transform a_from_b: p_a = R p_b + t, in metres. Tangents are (translation, rotation) with
// right perturbation: T * se3_exp(d); rotations in rad.
struct SE3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  SE3() = default;
  SE3(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) : rotation(q), translation(t) {}
  SE3(const Eigen::Matrix3d& r, const Eigen::Vector3d& t) : rotation(r), translation(t) {}

  static SE3 from_matrix(const Eigen::Matrix4d& matrix);

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }
  SE3 operator*(const SE3& other) const {
    return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
  }
  SE3 inverse() const {
    const Eigen::Quaterniond inverted = rotation.conjugate();
    return {inverted, -(inverted * translation)};
  }
  Eigen::Matrix3d rotation_matrix() const { return rotation.toRotationMatrix(); }
  Eigen::Matrix4d matrix() const;

  // Maps a tangent at the identity of b's frame to one of a's: T exp(d) T^-1 = exp(adjoint d).
  Matrix6d adjoint() const;
};

SE3 se3_exp(const Vector6d& tangent);
Vector6d se3_log(const SE3& transform);

// T with the tangent split: translation moved by R * d.head<3>(), rotation multiplied on the right
// by so3_exp(d.tail<3>()). Equal to T * se3_exp(d) to first order and cheaper: the retraction used
// by all solvers here.
SE3 se3_plus(const SE3& transform, const Vector6d& delta);
// The delta with se3_plus(from, delta) == to.
Vector6d se3_minus(const SE3& to, const SE3& from);

}  // namespace rover
