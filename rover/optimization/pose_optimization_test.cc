#include "rover/optimization/pose_optimization.h"

#include <cstring>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "rover/base/error.h"
#include "rover/optimization/simulated_bundle.h"

namespace rover {
namespace {

struct PoseProblem {
  SE3 truth;
  SE3 initial;
  std::vector<PoseObservation> observations;
  std::vector<char> is_outlier;
};

struct PoseSimulation {
  int observations = 100;
  double sigma = 1;
  double outliers = 0;
  double error = 0.05;  // m of the initial pose; half of it in rad
};

// A random pose and points in front of a random camera of it, 1 to 10 m deep.
PoseProblem simulate(const Rig& rig, const PoseSimulation& simulation, Random& random) {
  PoseProblem problem;
  problem.truth = random_pose(random, 5);
  while (static_cast<int>(problem.observations.size()) < simulation.observations) {
    const int index = random.index(rig.size());
    const Camera& camera = rig.cameras[index];
    const Eigen::Vector2d pixel(random.uniform(0, camera.width()),
                                random.uniform(0, camera.height()));
    const auto ray = camera.unproject(pixel);
    const double depth = random.uniform(1, 10);
    const Eigen::Vector2d noise(random.gaussian(), random.gaussian());
    const bool outlier = random.uniform() < simulation.outliers;
    if (!ray) continue;
    const double shift = outlier ? random.uniform(20, 100) : 0;
    problem.observations.push_back(
        {problem.truth * (rig.body_from_camera[index] * (depth * *ray)),
         pixel + simulation.sigma * noise + Eigen::Vector2d(shift, -shift), index,
         simulation.sigma > 0 ? simulation.sigma : 1});
    problem.is_outlier.push_back(outlier);
  }
  Vector6d delta;
  delta.head<3>() = simulation.error * random_gaussian_vector(random);
  delta.tail<3>() = 0.5 * simulation.error * random_gaussian_vector(random);
  problem.initial = se3_plus(problem.truth, delta);
  return problem;
}

Rig pinhole_rig() { return simulated_rig(simulated_pinhole(), 1); }
Rig fisheye_stereo_rig() { return simulated_rig(simulated_fisheye(), 2); }

TEST(PoseOptimization, FindsTheExactPoseWithoutNoise) {
  Random random(1);
  for (const Rig& rig : {pinhole_rig(), fisheye_stereo_rig()}) {
    for (int i = 0; i < 100; ++i) {
      const auto problem = simulate(rig, {.sigma = 0, .error = 0.2}, random);
      const auto estimate = optimize_pose(rig, problem.initial, problem.observations, {});
      ASSERT_TRUE(estimate.converged);
      EXPECT_LT(se3_minus(estimate.world_from_body, problem.truth).norm(), 1e-6);
      EXPECT_EQ(estimate.inlier_count, 100);
      EXPECT_LT(estimate.mean_chi2, 1e-6);
    }
  }
}

TEST(PoseOptimization, BoundsHoldTheErrors) {
  Random random(2);
  const int runs = 1500;
  for (const Rig& rig : {pinhole_rig(), fisheye_stereo_rig()}) {
    int within = 0;
    double squared_error = 0;
    for (int i = 0; i < runs; ++i) {
      const auto problem = simulate(rig, {.observations = 20 + i % 100, .sigma = 1.5}, random);
      const auto estimate = optimize_pose(rig, problem.initial, problem.observations, {});
      ASSERT_TRUE(estimate.converged);
      const Vector6d error = se3_minus(problem.truth, estimate.world_from_body);
      const Vector6d sigma = estimate.covariance.diagonal().cwiseSqrt();
      for (int k = 0; k < 6; ++k) within += std::abs(error[k]) < 3 * sigma[k];
      squared_error += error.dot(estimate.covariance.llt().solve(error));
    }
    EXPECT_GT(within, 0.95 * 6 * runs);
    EXPECT_LT(within, 0.999 * 6 * runs);
    // 6 for a chi-square variable of 6 degrees of freedom; somewhat more, since the rule that
    // removes outliers also takes one in twenty good observations, and not at random.
    EXPECT_GT(squared_error / runs, 6 - 5 * std::sqrt(2 * 6.0 / runs));
    EXPECT_LT(squared_error / runs, 7.5);
  }
}

TEST(PoseOptimization, SurvivesOutliers) {
  Random random(3);
  const Rig rig = pinhole_rig();
  for (int i = 0; i < 200; ++i) {
    const auto problem =
        simulate(rig, {.observations = 150, .outliers = 0.3, .error = 0.05}, random);
    const auto estimate = optimize_pose(rig, problem.initial, problem.observations, {});
    ASSERT_TRUE(estimate.converged);
    EXPECT_LT(se3_minus(estimate.world_from_body, problem.truth).head<3>().norm(), 0.05);
    for (std::size_t k = 0; k < problem.observations.size(); ++k) {
      if (problem.is_outlier[k]) {
        EXPECT_FALSE(estimate.inliers[k]);
      }
    }
    EXPECT_GT(estimate.inlier_count, 0.8 * 0.6 * 150);
  }
}

TEST(PoseOptimization, CovarianceGrowsWithAnUnderstatedNoise) {
  Random random(4);
  const Rig rig = pinhole_rig();
  auto problem = simulate(rig, {.observations = 300}, random);
  const PoseOptimizationOptions all = {.chi2 = 1e3, .huber = 30};
  const auto honest = optimize_pose(rig, problem.initial, problem.observations, all);
  for (auto& seen : problem.observations) seen.sigma /= 2;
  const auto understated = optimize_pose(rig, problem.initial, problem.observations, all);
  EXPECT_NEAR(understated.mean_chi2, 4 * honest.mean_chi2, 0.01);
  const double ratio = understated.covariance.trace() / honest.covariance.trace();
  EXPECT_NEAR(ratio, std::min(1.0, honest.mean_chi2 / 2), 0.01);
}

TEST(PoseOptimization, ReportsWhatItCannotSolve) {
  Random random(5);
  const Rig rig = pinhole_rig();
  const auto problem = simulate(rig, {}, random);
  const auto expect_refused = [&](const std::vector<PoseObservation>& seen) {
    const auto estimate = optimize_pose(rig, problem.initial, seen, {});
    EXPECT_FALSE(estimate.converged);
    EXPECT_EQ(estimate.world_from_body.translation, problem.initial.translation);
    EXPECT_EQ(estimate.world_from_body.rotation.coeffs(), problem.initial.rotation.coeffs());
    EXPECT_EQ(estimate.inliers.size(), seen.size());
    EXPECT_TRUE(estimate.covariance.isZero());
  };
  const auto& all = problem.observations;
  expect_refused({});
  expect_refused({all.begin(), all.begin() + 1});
  expect_refused({all.begin(), all.begin() + 3});
  expect_refused(std::vector<PoseObservation>(10, all[0]));  // one point, ten times
  auto behind = all;
  const SE3 back(Eigen::Quaterniond(0, 0, 1, 0), Eigen::Vector3d::Zero());  // turned about y
  for (auto& seen : behind)
    seen.point = problem.truth * (back * (problem.truth.inverse() * seen.point));
  expect_refused(behind);
  auto random_pixels = std::vector<PoseObservation>(all.begin(), all.begin() + 12);
  for (auto& seen : random_pixels) seen.pixel = {random.uniform(0, 700), random.uniform(0, 400)};
  expect_refused(random_pixels);
  auto broken = all;
  for (auto& seen : broken) seen.point.setConstant(std::nan(""));
  expect_refused(broken);
}

TEST(PoseOptimization, RefusesPointsOnALine) {
  const Rig rig = pinhole_rig();
  std::vector<PoseObservation> line;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d in_camera(-1 + 0.25 * i, 0.1 * i, 4 + 0.2 * i);
    line.push_back({rig.body_from_camera[0] * in_camera, *rig.cameras[0].project(in_camera)});
  }
  EXPECT_FALSE(optimize_pose(rig, SE3(), line, {}).converged);
}

TEST(PoseOptimization, PointsThatAreNotSeenAreOutliers) {
  Random random(6);
  const Rig rig = pinhole_rig();
  auto problem = simulate(rig, {}, random);
  problem.observations[7].point = problem.truth * Eigen::Vector3d(0, 0, -5);
  const auto estimate = optimize_pose(rig, problem.initial, problem.observations, {});
  ASSERT_TRUE(estimate.converged);
  EXPECT_FALSE(estimate.inliers[7]);
}

TEST(PoseOptimization, DoesNotDependOnTheWorldFrame) {
  Random random(7);
  const Rig rig = fisheye_stereo_rig();
  for (int i = 0; i < 50; ++i) {
    auto problem = simulate(rig, {.outliers = 0.1}, random);
    const auto before = optimize_pose(rig, problem.initial, problem.observations, {});
    const SE3 motion = random_pose(random, 10);
    for (auto& seen : problem.observations) seen.point = motion * seen.point;
    const auto after = optimize_pose(rig, motion * problem.initial, problem.observations, {});
    EXPECT_EQ(after.inliers, before.inliers);
    const SE3 expected = motion * before.world_from_body;
    EXPECT_LT(se3_minus(after.world_from_body, expected).norm(), 1e-6);
    EXPECT_LT((after.covariance - before.covariance).norm(), 1e-5 * before.covariance.norm());
  }
}

TEST(PoseOptimization, GivesTheSameBytesTwice) {
  Random random(8);
  const Rig rig = pinhole_rig();
  const auto problem = simulate(rig, {.outliers = 0.2}, random);
  const auto a = optimize_pose(rig, problem.initial, problem.observations, {});
  const auto b = optimize_pose(rig, problem.initial, problem.observations, {});
  EXPECT_EQ(std::memcmp(a.world_from_body.translation.data(), b.world_from_body.translation.data(),
                        3 * sizeof(double)),
            0);
  EXPECT_EQ(std::memcmp(a.covariance.data(), b.covariance.data(), 36 * sizeof(double)), 0);
}

TEST(PoseOptimization, RefusesOptionsThatMakeNoSense) {
  const Rig rig = pinhole_rig();
  EXPECT_THROW(optimize_pose(rig, {}, {}, {.rounds = 0}), InputError);
  EXPECT_THROW(optimize_pose(rig, {}, {}, {.iterations = 0}), InputError);
  EXPECT_THROW(optimize_pose(rig, {}, {}, {.chi2 = -1}), InputError);
  EXPECT_THROW(optimize_pose(rig, {}, {}, {.huber = 0}), InputError);
  EXPECT_THROW(optimize_pose(rig, {}, {}, {.min_step = -1}), InputError);
}

}  // namespace
}  // namespace rover
