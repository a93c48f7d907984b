#include "rover/geometry/absolute_pose.h"

#include <array>
#include <limits>

#include <Eigen/Cholesky>
#include <opengv/absolute_pose/CentralAbsoluteAdapter.hpp>
#include <opengv/absolute_pose/methods.hpp>

#include "rover/geometry/bearing.h"

namespace rover {
namespace {

constexpr double kChiSquare95TwoDegrees = 5.991;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Squared sine of the angle between a bearing and where the pose expects the point.
double squared_error(const PointBearing& seen, const SE3& camera_from_world) {
  const Eigen::Vector3d p = camera_from_world * seen.point;
  if (!(p.dot(seen.bearing) > 0)) return kInfinity;
  return p.cross(seen.bearing).squaredNorm() / p.squaredNorm();
}

struct PoseEquations {
  Matrix6d h = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0;

  // The error is the part of p / |p| across the bearing, p the point in the camera's frame. With
  // the body moved by se3_plus(world_from_body, d), p_body becomes p_body - d_t + p_body x d_r.
  void add(const PointBearing& seen, const SE3& body_from_world, const SE3& body_from_camera) {
    const Eigen::Vector3d p_body = body_from_world * seen.point;
    const Eigen::Vector3d p = body_from_camera.inverse() * p_body;
    if (!(p.dot(seen.bearing) > 0)) {
      cost = kInfinity;
      return;
    }
    const double distance = p.norm();
    const Eigen::Vector3d unit = p / distance;
    const Eigen::Matrix<double, 2, 3> across = tangent_basis(seen.bearing).transpose();
    const Eigen::Matrix<double, 2, 3> by_body =
        across * (Eigen::Matrix3d::Identity() - unit * unit.transpose()) / distance *
        body_from_camera.rotation.conjugate().toRotationMatrix();
    Eigen::Matrix<double, 2, 6> jacobian;
    jacobian << -by_body, by_body * skew(p_body);
    const Eigen::Vector2d error = across * unit;
    h += jacobian.transpose() * jacobian;
    gradient += jacobian.transpose() * error;
    cost += error.squaredNorm();
  }
};

PoseEquations pose_equations(std::span<const PointBearing> correspondences,
                             std::span<const SE3> body_from_camera, const SE3& world_from_body,
                             const std::vector<int>& indices) {
  const SE3 body_from_world = world_from_body.inverse();
  PoseEquations sum;
  for (const int i : indices)
    sum.add(correspondences[i], body_from_world, body_from_camera[correspondences[i].camera]);
  return sum;
}

class P3pProblem {
 public:
  struct Model {
    SE3 world_from_body;
    std::vector<SE3> camera_from_world;
  };
  static constexpr int kSampleSize = 3;

  P3pProblem(std::span<const PointBearing> correspondences, std::span<const SE3> body_from_camera,
             double sigma)
      : correspondences_(correspondences),
        body_from_camera_(body_from_camera),
        threshold_(kChiSquare95TwoDegrees * sigma * sigma),
        of_camera_(body_from_camera.size()) {
    for (int i = 0; i < size(); ++i) of_camera_.at(correspondences[i].camera).push_back(i);
    for (int i = 0; i < size(); ++i)
      if (of_camera_[correspondences[i].camera].size() >= kSampleSize) first_.push_back(i);
  }

  bool can_sample() const { return !first_.empty(); }
  int size() const { return static_cast<int>(correspondences_.size()); }
  double threshold() const { return threshold_; }

  // Cameras in proportion to what they see.
  std::array<int, kSampleSize> sample(Random& random) const {
    const int first = first_[random.index(static_cast<int>(first_.size()))];
    const auto& group = of_camera_[correspondences_[first].camera];
    auto sample = draw_sample<kSampleSize>(static_cast<int>(group.size()), random);
    for (int& index : sample) index = group[index];
    return sample;
  }

  std::vector<Model> solve(const std::array<int, kSampleSize>& sample) const {
    opengv::bearingVectors_t bearings;
    opengv::points_t points;
    for (const int i : sample) {
      bearings.push_back(correspondences_[i].bearing);
      points.push_back(correspondences_[i].point);
    }
    const opengv::absolute_pose::CentralAbsoluteAdapter adapter(bearings, points);
    const SE3 camera_from_body = body_from_camera_[correspondences_[sample[0]].camera].inverse();
    std::vector<Model> models;
    for (const auto& solution : opengv::absolute_pose::p3p_kneip(adapter, 0, 1, 2)) {
      if (!solution.allFinite()) continue;
      const Eigen::Matrix3d rotation = solution.leftCols<3>();
      const SE3 world_from_camera(Eigen::Quaterniond(rotation).normalized(), solution.col(3));
      models.push_back(model(world_from_camera * camera_from_body));
    }
    return models;
  }

  double squared_error(const Model& model, int i) const {
    const PointBearing& seen = correspondences_[i];
    return rover::squared_error(seen, model.camera_from_world[seen.camera]);
  }

  Model refine(const Model& start, const std::vector<int>& inliers) const {
    return model(
        refine_absolute_pose(correspondences_, body_from_camera_, start.world_from_body, inliers));
  }

 private:
  Model model(const SE3& world_from_body) const {
    Model model{world_from_body, {}};
    for (const SE3& pose : body_from_camera_)
      model.camera_from_world.push_back((world_from_body * pose).inverse());
    return model;
  }

  std::span<const PointBearing> correspondences_;
  std::span<const SE3> body_from_camera_;
  double threshold_;
  std::vector<std::vector<int>> of_camera_;
  std::vector<int> first_;  // correspondences whose camera has enough for a sample
};

}  // namespace

void AbsolutePoseOptions::check() const {
  ransac.check();
  require(sigma_px > 0, "absolute pose: sigma_px must be positive");
  require(focal_length > 0, "absolute pose: focal_length must be positive");
  require(min_inliers >= 4, "absolute pose: min_inliers must be at least 4");
}

SE3 refine_absolute_pose(std::span<const PointBearing> correspondences,
                         std::span<const SE3> body_from_camera, const SE3& world_from_body,
                         const std::vector<int>& indices, int max_iterations) {
  SE3 pose = world_from_body;
  PoseEquations current = pose_equations(correspondences, body_from_camera, pose, indices);
  for (int i = 0; i < max_iterations; ++i) {
    const Vector6d step = current.h.ldlt().solve(current.gradient);
    if (!step.allFinite()) break;
    const SE3 next = se3_plus(pose, -step);
    const PoseEquations ahead = pose_equations(correspondences, body_from_camera, next, indices);
    if (!(ahead.cost < current.cost)) break;
    const bool converged = ahead.cost > (1 - 1e-9) * current.cost;
    pose = next;
    current = ahead;
    if (converged) break;
  }
  return pose;
}

std::optional<AbsolutePose> estimate_absolute_pose(std::span<const PointBearing> correspondences,
                                                   std::span<const SE3> body_from_camera,
                                                   const AbsolutePoseOptions& options) {
  options.check();
  const P3pProblem problem(correspondences, body_from_camera, options.sigma());
  if (!problem.can_sample()) return std::nullopt;
  const auto result = ransac(problem, options.ransac);
  if (!result || static_cast<int>(result->inliers.size()) < options.min_inliers)
    return std::nullopt;
  return AbsolutePose{result->model.world_from_body, result->inliers, result->iterations};
}

std::optional<AbsolutePose> estimate_absolute_pose(std::span<const PointBearing> correspondences,
                                                   const AbsolutePoseOptions& options) {
  const SE3 identity;
  return estimate_absolute_pose(correspondences, std::span(&identity, 1), options);
}

}  // namespace rover
