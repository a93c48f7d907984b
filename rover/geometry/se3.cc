#include "rover/geometry/se3.h"

namespace rover {

SE3 SE3::from_matrix(const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  return {Eigen::Quaterniond(rotation).normalized(), matrix.topRightCorner<3, 1>()};
}

Eigen::Matrix4d SE3::matrix() const {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = rotation_matrix();
  matrix.topRightCorner<3, 1>() = translation;
  return matrix;
}

Matrix6d SE3::adjoint() const {
  const Eigen::Matrix3d r = rotation_matrix();
  Matrix6d adjoint = Matrix6d::Zero();
  adjoint.topLeftCorner<3, 3>() = r;
  adjoint.topRightCorner<3, 3>() = skew(translation) * r;
  adjoint.bottomRightCorner<3, 3>() = r;
  return adjoint;
}

// Solà et al., equation 172; the left Jacobian at v is the right one at -v.
SE3 se3_exp(const Vector6d& tangent) {
  const Eigen::Vector3d rotation = tangent.tail<3>();
  return {so3_exp(rotation), so3_right_jacobian(-rotation) * tangent.head<3>()};
}

Vector6d se3_log(const SE3& transform) {
  const Eigen::Vector3d rotation = so3_log(transform.rotation);
  Vector6d tangent;
  tangent << so3_right_jacobian_inverse(-rotation) * transform.translation, rotation;
  return tangent;
}

SE3 se3_plus(const SE3& transform, const Vector6d& delta) {
  return {(transform.rotation * so3_exp(delta.tail<3>())).normalized(),
          transform.translation + transform.rotation * delta.head<3>()};
}

Vector6d se3_minus(const SE3& to, const SE3& from) {
  const Eigen::Quaterniond inverted = from.rotation.conjugate();
  Vector6d delta;
  delta << inverted * (to.translation - from.translation), so3_log(inverted * to.rotation);
  return delta;
}

}  // namespace rover
