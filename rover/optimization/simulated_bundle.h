#pragma once

#include <algorithm>

#include "rover/geometry/random_geometry.h"
#include "rover/optimization/bundle_adjustment.h"

namespace rover {

// Adjustment problems with known answers, for tests and benchmarks.

// A pinhole camera with the distortion of the EuRoC data set's lenses.
inline Camera simulated_pinhole() {
  return Camera(CameraModel::kPinhole, 752, 480, {458.7, 457.3, 367.2, 248.4},
                {-0.2834, 0.0740, 0.0002, 0.00002});
}

inline Camera simulated_fisheye() {
  return Camera(CameraModel::kFisheye, 512, 512, {190.98, 190.97, 254.93, 256.90},
                {0.0035, 0.0007, -0.0021, 0.0002});
}

// Cameras side by side, 0.11 m apart and slightly turned; none is at the body's origin.
inline Rig simulated_rig(const Camera& camera, int cameras) {
  Rig rig;
  for (int i = 0; i < cameras; ++i) {
    rig.cameras.push_back(camera);
    rig.body_from_camera.emplace_back(so3_exp({0.01, -0.02 * i, 0.03}),
                                      Eigen::Vector3d(0.05 + 0.11 * i, -0.02, 0.01));
  }
  return rig;
}

struct BundleSimulation {
  Rig rig = simulated_rig(simulated_pinhole(), 1);
  int fixed_poses = 2;
  int free_poses = 6;
  int points = 300;
  int poses_per_point = 5;    // neighbours on the path
  double sigma = 1;           // px, noise of the observations
  double outliers = 0;        // share of the observations that point anywhere in the image
  double pose_error = 0.02;   // m; a tenth of it in rad
  double point_error = 0.05;  // m
  std::uint64_t seed = 1;
};

struct SimulatedBundle {
  BundleProblem truth;    // true poses and points, noisy observations
  BundleProblem problem;  // the same, disturbed
  std::vector<char> is_outlier;
};

namespace internal {

// A walk sideways along a wall of points, with wobbles; fixed poses first.
inline void add_poses(const BundleSimulation& simulation, Random& random, BundleProblem& problem) {
  for (int i = 0; i < simulation.fixed_poses + simulation.free_poses; ++i) {
    const SE3 wobble = random_pose(random, 0.03, 0.1);
    problem.world_from_body.push_back(SE3(Eigen::Quaterniond::Identity(), {0.25 * i, 0, 0}) *
                                      wobble);
    problem.pose_fixed.push_back(i < simulation.fixed_poses);
  }
}

inline void observe(const BundleSimulation& simulation, int pose, int point, Random& random,
                    SimulatedBundle& result) {
  BundleProblem& truth = result.truth;
  for (int camera = 0; camera < truth.rig.size(); ++camera) {
    const SE3 world_from_camera = truth.world_from_body[pose] * truth.rig.body_from_camera[camera];
    const Camera& model = truth.rig.cameras[camera];
    const auto pixel = model.project(world_from_camera.inverse() * truth.points[point]);
    if (!pixel || !model.contains(*pixel)) continue;
    const bool outlier = random.uniform() < simulation.outliers;
    const Eigen::Vector2d noise(random.gaussian(), random.gaussian());
    const Eigen::Vector2d anywhere(random.uniform(0, model.width()),
                                   random.uniform(0, model.height()));
    const Eigen::Vector2d seen = outlier ? anywhere : *pixel + simulation.sigma * noise;
    truth.observations.push_back({pose, point, camera, seen, std::max(simulation.sigma, 0.1)});
    result.is_outlier.push_back(outlier);
  }
}

inline void disturb(const BundleSimulation& simulation, Random& random, BundleProblem& problem) {
  for (std::size_t i = 0; i < problem.world_from_body.size(); ++i) {
    if (problem.pose_fixed[i]) continue;
    Vector6d delta;
    delta.head<3>() = simulation.pose_error * random_gaussian_vector(random);
    delta.tail<3>() = 0.1 * simulation.pose_error * random_gaussian_vector(random);
    problem.world_from_body[i] = se3_plus(problem.world_from_body[i], delta);
  }
  for (auto& point : problem.points)
    point += simulation.point_error * random_gaussian_vector(random);
}

}  // namespace internal

inline SimulatedBundle simulate_bundle(const BundleSimulation& simulation) {
  Random random(simulation.seed);
  SimulatedBundle result;
  BundleProblem& truth = result.truth;
  truth.rig = simulation.rig;
  internal::add_poses(simulation, random, truth);
  const int poses = static_cast<int>(truth.world_from_body.size());
  for (int point = 0; point < simulation.points; ++point) {
    const double place = random.uniform(-1, 0.25 * poses + 1);
    const double height = random.uniform(-2, 2);
    truth.points.emplace_back(place, height, random.uniform(3, 8));
    const int centre = static_cast<int>(place / 0.25) - simulation.poses_per_point / 2;
    const int begin = std::clamp(centre, 0, std::max(0, poses - simulation.poses_per_point));
    const int end = std::min(poses, begin + simulation.poses_per_point);
    for (int pose = begin; pose < end; ++pose)
      internal::observe(simulation, pose, point, random, result);
  }
  result.problem = truth;
  internal::disturb(simulation, random, result.problem);
  return result;
}

// The same problem with disparities in place of what the second camera sees besides the first.
inline BundleProblem with_disparities(BundleProblem problem) {
  auto& seen = problem.observations;
  for (std::size_t i = 1; i < seen.size(); ++i) {
    const BundleObservation& left = seen[i - 1];
    if (left.camera != 0 || seen[i].camera != 1 || left.pose != seen[i].pose ||
        left.point != seen[i].point)
      continue;
    seen[i].camera = kDisparity;
    seen[i].pixel -= left.pixel;
  }
  return problem;
}

// The same problem seen from another world frame: p -> scale * (motion p). Scaling keeps the
// residuals only for a rig of one camera at the body's origin.
inline BundleProblem moved(BundleProblem problem, const SE3& motion, double scale) {
  for (SE3& pose : problem.world_from_body) {
    pose = motion * pose;
    pose.translation *= scale;
  }
  for (auto& point : problem.points) point = scale * (motion * point);
  return problem;
}

}  // namespace rover
