#include "rover/optimization/reprojection.h"

#include "rover/optimization/robust_kernel.h"

namespace rover {
namespace {

// skew(x)^T * m: the columns of m crossed with x.
inline Eigen::Matrix3d crossed_columns(const Eigen::Matrix3d& m, const Eigen::Vector3d& x) {
  Eigen::Matrix3d result;
  result.row(0) = m.row(1) * x[2] - m.row(2) * x[1];
  result.row(1) = m.row(2) * x[0] - m.row(0) * x[2];
  result.row(2) = m.row(0) * x[1] - m.row(1) * x[0];
  return result;
}

}  // namespace

Reprojector::Reprojector(const Rig& rig) : rig_(rig) {
  camera_from_body_.reserve(rig.body_from_camera.size());
  for (const SE3& body_from_camera : rig.body_from_camera) {
    const SE3 inverse = body_from_camera.inverse();
    camera_from_body_.push_back({inverse.rotation_matrix(), inverse.translation});
  }
}

std::optional<Reprojector::Projection> Reprojector::project(int camera,
                                                            const Eigen::Vector3d& point_in_body,
                                                            bool jacobian) const {
  const Extrinsics& extrinsics = camera_from_body_[camera];
  const Eigen::Vector3d point = extrinsics.rotation * point_in_body + extrinsics.translation;
  Matrix23d by_point;
  const auto pixel = rig_.cameras[camera].project(point, jacobian ? &by_point : nullptr);
  if (!pixel) return std::nullopt;
  Projection projection;
  projection.pixel = *pixel;
  if (jacobian) projection.by_body_point.noalias() = by_point.lazyProduct(extrinsics.rotation);
  return projection;
}

bool Reprojector::evaluate(int camera, const Eigen::Vector3d& point_in_body,
                           const Eigen::Vector2d& pixel, double sigma, Eigen::Vector2d& residual,
                           Matrix23d* by_body_point) const {
  return ObservedPoint(*this, point_in_body, by_body_point != nullptr)
      .evaluate(camera, pixel, sigma, residual, by_body_point);
}

bool Reprojector::evaluate(int camera, const SE3& world_from_body, const Eigen::Vector3d& point,
                           const Eigen::Vector2d& pixel, double sigma, Eigen::Vector2d& residual,
                           Matrix26d* by_pose, Matrix23d* by_point) const {
  const BodyFrame frame(world_from_body);
  const Eigen::Vector3d x = frame.from_world(point);
  Matrix23d jacobian;
  const bool wanted = by_pose || by_point;
  if (!evaluate(camera, x, pixel, sigma, residual, wanted ? &jacobian : nullptr)) return false;
  if (by_pose) *by_pose << -jacobian, jacobian * skew(x);
  if (by_point) *by_point = jacobian * frame.rotation.transpose();
  return true;
}

double Reprojector::chi2(int camera, const Eigen::Vector3d& point_in_body,
                         const Eigen::Vector2d& pixel, double sigma) const {
  return ObservedPoint(*this, point_in_body, false).chi2(camera, pixel, sigma);
}

const std::optional<Reprojector::Projection>& ObservedPoint::in_first_camera() {
  if (!looked_) first_ = reprojector_.project(0, point_, jacobian_);
  looked_ = true;
  return first_;
}

// What an observation's pixel is compared with.
std::optional<Reprojector::Projection> ObservedPoint::expected(int camera) {
  if (camera == 0) return in_first_camera();
  if (camera != kDisparity) return reprojector_.project(camera, point_, jacobian_);
  const auto& left = in_first_camera();
  if (!left) return std::nullopt;
  auto difference = reprojector_.project(1, point_, jacobian_);
  if (!difference) return std::nullopt;
  difference->pixel -= left->pixel;
  if (jacobian_) difference->by_body_point -= left->by_body_point;
  return difference;
}

bool ObservedPoint::evaluate(int camera, const Eigen::Vector2d& pixel, double sigma,
                             Eigen::Vector2d& residual, Matrix23d* by_body_point) {
  const auto projection = expected(camera);
  if (!projection) return false;
  const double scale = 1 / sigma;
  residual = scale * (pixel - projection->pixel);
  if (by_body_point) *by_body_point = -scale * projection->by_body_point;
  return true;
}

double ObservedPoint::chi2(int camera, const Eigen::Vector2d& pixel, double sigma) {
  Eigen::Vector2d residual;
  return evaluate(camera, pixel, sigma, residual, nullptr) ? residual.squaredNorm() : kUnseenChi2;
}

void PointInformation::add_to_pose(const Eigen::Vector3d& x, Matrix6d& pose_hessian,
                                   Vector6d& pose_gradient) const {
  // [-I, S]^T hessian [-I, S] with S = skew(x); S^T (S^T hessian)^T = S^T hessian S.
  const Eigen::Matrix3d rotated = crossed_columns(hessian, x);
  pose_hessian.topLeftCorner<3, 3>() += hessian;
  pose_hessian.bottomLeftCorner<3, 3>() -= rotated;
  pose_hessian.topRightCorner<3, 3>() -= rotated.transpose();
  pose_hessian.bottomRightCorner<3, 3>() += crossed_columns(rotated.transpose(), x);
  pose_gradient.head<3>() -= gradient;
  pose_gradient.tail<3>() += gradient.cross(x);
}

Matrix63d PointInformation::cross(const Eigen::Vector3d& x,
                                  const Eigen::Matrix3d& world_from_body) const {
  const Eigen::Matrix3d turned = hessian * world_from_body.transpose();
  Matrix63d result;
  result.topRows<3>() = -turned;
  result.bottomRows<3>() = crossed_columns(turned, x);
  return result;
}

}  // namespace rover
