#include "rover/optimization/drift.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "rover/geometry/so3.h"

namespace rover {
namespace {

const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();

}  // namespace

Eigen::Matrix4d drift_of(const SE3& world_from_body, const Matrix6d& covariance) {
  const Eigen::Matrix3d rotation = world_from_body.rotation_matrix();
  const Eigen::RowVector3d turn = kUp.transpose() * rotation;
  Eigen::Matrix<double, 4, 6> by_pose = Eigen::Matrix<double, 4, 6>::Zero();
  by_pose.topLeftCorner<3, 3>() = rotation;
  by_pose.topRightCorner<3, 3>() = -kUp.cross(world_from_body.translation) * turn;
  by_pose.bottomRightCorner<1, 3>() = turn;
  return by_pose * covariance * by_pose.transpose();
}

Matrix6d with_drift(const SE3& world_from_body, const Matrix6d& covariance,
                    const Eigen::Matrix4d& drift) {
  const Eigen::Matrix3d inverse = world_from_body.rotation_matrix().transpose();
  Eigen::Matrix<double, 6, 4> by_drift = Eigen::Matrix<double, 6, 4>::Zero();
  by_drift.topLeftCorner<3, 3>() = inverse;
  by_drift.topRightCorner<3, 1>() = inverse * kUp.cross(world_from_body.translation);
  by_drift.bottomRightCorner<3, 1>() = inverse * kUp;
  return covariance + by_drift * drift * by_drift.transpose();
}

Eigen::Matrix4d drift_at(const Eigen::Vector3d& position, const Matrix7d& similarity) {
  Eigen::Matrix<double, 4, 7> by_similarity = Eigen::Matrix<double, 4, 7>::Zero();
  by_similarity.topLeftCorner<3, 3>().setIdentity();
  by_similarity.block<3, 2>(0, 3) = -skew(position).leftCols<2>();
  by_similarity.block<3, 1>(0, 6) = position;
  by_similarity(3, 5) = 1;
  return by_similarity * similarity * by_similarity.transpose();
}

// The position moves by t + w x p + s p.
Matrix7d similarity_by_pose(const SE3& world_from_body) {
  const Eigen::Matrix3d rotation = world_from_body.rotation_matrix();
  Matrix7d by_pose = Matrix7d::Zero();
  by_pose.block<3, 3>(0, 0) = rotation;
  by_pose.block<3, 3>(0, 3) = skew(world_from_body.translation) * rotation;
  by_pose.block<3, 1>(0, 6) = -world_from_body.translation;
  by_pose.block<3, 3>(3, 3) = rotation;
  by_pose(6, 6) = 1;
  return by_pose;
}

Eigen::Matrix3d map_error_of(const Matrix7d& similarity) {
  constexpr int kAt[] = {3, 4, 6};
  return similarity(kAt, kAt);
}

// Measured by the two together, which may be zero in some directions.
Eigen::Matrix4d at_least(const Eigen::Matrix4d& covariance, const Eigen::Matrix4d& other) {
  constexpr double kRounding = 1e-12;
  const Eigen::Matrix4d sum = covariance + other;
  const Eigen::Array4d variances = sum.diagonal().array();
  const Eigen::Vector4d units = (variances > 0).select(variances.sqrt(), 1.0).matrix();
  const auto in_units = [&](const Eigen::Matrix4d& m) -> Eigen::Matrix4d {
    return m.cwiseQuotient(units * units.transpose());
  };
  const Eigen::Matrix4d metric = in_units(sum) + kRounding * Eigen::Matrix4d::Identity();
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix4d> solver(
      in_units(other - covariance), metric);
  const Eigen::Matrix4d axes = units.asDiagonal() * metric * solver.eigenvectors();
  const Eigen::Vector4d more = solver.eigenvalues().cwiseMax(0);
  return covariance + axes * more.asDiagonal() * axes.transpose();
}

}  // namespace rover
