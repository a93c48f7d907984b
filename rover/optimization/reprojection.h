#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "rover/camera/camera.h"
#include "rover/geometry/se3.h"

namespace rover {

using Matrix26d = Eigen::Matrix<double, 2, 6>;
using Matrix63d = Eigen::Matrix<double, 6, 3>;

// As the camera of an observation: its pixel is the point's place in camera 1 less that in camera
// 0. Both images show one patch around the feature, wherever on the landmark it lies, so the
// difference is far better known than either place, whose errors they share (docs/matching.md). The
// images must be alike but for the shift, as alignment of the partner asks too.
constexpr int kDisparity = -1;

// The reprojection residual, (pixel - projection) / sigma, through a camera's own model and its
// place in the body frame; dimensionless (in sigmas).
//
// With x the point in the body frame and J = d residual / d x, the Jacobians by the pose
// world_from_body (tangent of se3_plus) and by the point in the world are
//   [-J, J skew(x)]   and   J R^T,
// so that every block of the normal equations follows from J^T J and x alone (PointInformation).
class Reprojector {
 public:
  // Where a camera sees a point, in px, and the Jacobian by the point in the body frame.
  struct Projection {
    Eigen::Vector2d pixel;
    Matrix23d by_body_point;
  };

  // Keeps a reference to the rig and the inverses of its extrinsics.
  explicit Reprojector(const Rig& rig);

  // Of a point in the body frame, m. Nothing where the camera does not see it. Without `jacobian`
  // that is left unset.
  std::optional<Projection> project(int camera, const Eigen::Vector3d& point_in_body,
                                    bool jacobian) const;

  // Residual of a point in the body frame (m) and, if asked for, its Jacobian by that point. False,
  // leaving the outputs as they are, where the camera does not see the point.
  bool evaluate(int camera, const Eigen::Vector3d& point_in_body, const Eigen::Vector2d& pixel,
                double sigma, Eigen::Vector2d& residual, Matrix23d* by_body_point) const;

  // The same for a point in the world, with Jacobians by the pose and by the point.
  bool evaluate(int camera, const SE3& world_from_body, const Eigen::Vector3d& point,
                const Eigen::Vector2d& pixel, double sigma, Eigen::Vector2d& residual,
                Matrix26d* by_pose, Matrix23d* by_point) const;

  // Squared norm of the residual; kUnseenChi2 where the camera does not see the point.
  double chi2(int camera, const Eigen::Vector3d& point_in_body, const Eigen::Vector2d& pixel,
              double sigma) const;

 private:
  struct Extrinsics {
    Eigen::Matrix3d rotation;  // camera_from_body
    Eigen::Vector3d translation;
  };
  const Rig& rig_;
  std::vector<Extrinsics> camera_from_body_;
};

// A point in the body frame, of which several observations tell: what two of them need, the place
// in camera 0, is computed once. Keeps a reference.
class ObservedPoint {
 public:
  // `jacobian`: whether Jacobians will be asked for.
  ObservedPoint(const Reprojector& reprojector, const Eigen::Vector3d& point_in_body, bool jacobian)
      : reprojector_(reprojector), point_(point_in_body), jacobian_(jacobian) {}

  // As Reprojector::evaluate.
  bool evaluate(int camera, const Eigen::Vector2d& pixel, double sigma, Eigen::Vector2d& residual,
                Matrix23d* by_body_point);
  double chi2(int camera, const Eigen::Vector2d& pixel, double sigma);

 private:
  const std::optional<Reprojector::Projection>& in_first_camera();
  std::optional<Reprojector::Projection> expected(int camera);

  const Reprojector& reprojector_;
  Eigen::Vector3d point_;
  bool jacobian_;
  bool looked_ = false;
  std::optional<Reprojector::Projection> first_;
};

// A pose as used in inner loops: a rotation matrix costs half of a quaternion per point.
struct BodyFrame {
  explicit BodyFrame(const SE3& world_from_body)
      : rotation(world_from_body.rotation_matrix()), translation(world_from_body.translation) {}

  Eigen::Vector3d from_world(const Eigen::Vector3d& point) const {
    return rotation.transpose() * (point - translation);
  }

  Eigen::Matrix3d rotation;  // world_from_body
  Eigen::Vector3d translation;
};

// What the observations of one point from one pose say about it, in the body frame: the sums of
// weight J^T J and weight J^T residual.
struct PointInformation {
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();

  void add(const Matrix23d& by_body_point, const Eigen::Vector2d& residual, double weight) {
    const Matrix23d weighted = weight * by_body_point;
    hessian.noalias() += weighted.transpose().lazyProduct(by_body_point);
    gradient.noalias() += weighted.transpose().lazyProduct(residual);
  }

  // Adds the blocks of the pose that sees the point at x (body frame).
  void add_to_pose(const Eigen::Vector3d& x, Matrix6d& pose_hessian, Vector6d& pose_gradient) const;

  // The block of the pose (rows) and the point in the world (columns).
  Matrix63d cross(const Eigen::Vector3d& x, const Eigen::Matrix3d& world_from_body) const;
};

}  // namespace rover
