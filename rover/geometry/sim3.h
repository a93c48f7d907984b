#pragma once

#include "rover/geometry/se3.h"

namespace rover {

using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

// A similarity a_from_b: p_a = s R p_b + t. Tangents are (translation, rotation in rad, log of the
// scale) with right perturbation: T * sim3_exp(d).
// Formulas: Strasdat, "Local accuracy and global consistency for efficient visual SLAM" (2012),
// section 2.4.5; derived here from the integral of exp(u (skew(w) + l I)) over u in [0, 1].
struct Sim3 {
  double scale = 1;  // positive
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Sim3() = default;
  Sim3(double s, const Eigen::Quaterniond& q, const Eigen::Vector3d& t)
      : scale(s), rotation(q), translation(t) {}
  explicit Sim3(const SE3& transform, double s = 1)
      : scale(s), rotation(transform.rotation), translation(transform.translation) {}

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (rotation * point) + translation;
  }
  Sim3 operator*(const Sim3& other) const {
    return {scale * other.scale, (rotation * other.rotation).normalized(),
            *this * other.translation};
  }
  Sim3 inverse() const {
    const Eigen::Quaterniond inverted = rotation.conjugate();
    return {1 / scale, inverted, -(inverted * translation) / scale};
  }
  Eigen::Matrix4d matrix() const;

  // Maps a tangent at the identity of b's frame to one of a's: T exp(d) T^-1 = exp(adjoint d).
  Matrix7d adjoint() const;
};

// Accurate to about 1e-13, where angle or log scale vanish too.
Sim3 sim3_exp(const Vector7d& tangent);
// The rotation part has a norm of at most pi.
Vector7d sim3_log(const Sim3& transform);

// The pose in map a of a camera whose pose in map b is b_from_camera, where a_from_b changes scale:
// the camera's axes and centre are moved, its pixels stay (its own unit becomes a's).
inline SE3 move_pose(const Sim3& a_from_b, const SE3& b_from_camera) {
  return {(a_from_b.rotation * b_from_camera.rotation).normalized(),
          a_from_b * b_from_camera.translation};
}

}  // namespace rover
