#include "rover/optimization/point_refinement.h"

#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "rover/base/error.h"
#include "rover/optimization/robust_kernel.h"
#include "rover/optimization/simulated_bundle.h"

namespace rover {
namespace {

// Views of a point from a row of cameras, `spacing` m apart.
std::vector<PointObservation> observe(const Rig& rig, const Eigen::Vector3d& point, int poses,
                                      double spacing, double sigma, Random& random) {
  std::vector<PointObservation> result;
  for (int i = 0; i < poses; ++i) {
    const SE3 pose(random_rotation(random, 0.1), Eigen::Vector3d(spacing * i, 0, 0));
    for (int camera = 0; camera < rig.size(); ++camera) {
      const SE3 camera_from_world = (pose * rig.body_from_camera[camera]).inverse();
      const Eigen::Vector2d noise(random.gaussian(), random.gaussian());
      const auto pixel = rig.cameras[camera].project(camera_from_world * point);
      result.push_back({pose, *pixel + sigma * noise, camera, sigma > 0 ? sigma : 1});
    }
  }
  return result;
}

TEST(PointRefinement, FindsThePointFromAfar) {
  Random random(1);
  for (const Camera& camera : {simulated_pinhole(), simulated_fisheye()}) {
    const Rig rig = simulated_rig(camera, 1);
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d truth(random.uniform(-1, 1), random.uniform(-1, 1), 4);
      const auto seen = observe(rig, truth, 3, 0.3, 0, random);
      const auto estimate = refine_point(rig, seen, truth * random.uniform(0.5, 2));
      ASSERT_TRUE(estimate.converged);
      const Eigen::Vector3d error = estimate.point - truth;  // far below the uncertainty at 1 px
      EXPECT_LT(error.dot(estimate.covariance.llt().solve(error)), 1e-4);
      EXPECT_LT(estimate.chi2, 1e-4);
    }
  }
}

TEST(PointRefinement, CovarianceAndChiSquareAreConsistent) {
  Random random(2);
  const Rig rig = simulated_rig(simulated_pinhole(), 2);
  const int runs = 1000;
  double squared_error = 0, chi2 = 0;
  for (int i = 0; i < runs; ++i) {
    const Eigen::Vector3d truth(random.uniform(-1, 1), random.uniform(-1, 1), 4);
    const auto seen = observe(rig, truth, 3, 0.3, 0.7, random);
    const auto estimate = refine_point(rig, seen, truth + Eigen::Vector3d(0.1, 0.1, 0.3));
    ASSERT_TRUE(estimate.converged);
    const Eigen::Vector3d error = estimate.point - truth;
    squared_error += error.dot(estimate.covariance.llt().solve(error));
    chi2 += estimate.chi2;
    EXPECT_LE(estimate.worst_chi2, estimate.chi2);
  }
  // Means of chi-square variables of 3 and 2 * 6 - 3 degrees of freedom, within 5 deviations.
  EXPECT_NEAR(squared_error / runs, 3, 5 * std::sqrt(2 * 3.0 / runs));
  EXPECT_NEAR(chi2 / runs, 9, 5 * std::sqrt(2 * 9.0 / runs));
}

TEST(PointRefinement, OneBadObservationShowsInTheChiSquare) {
  Random random(3);
  const Rig rig = simulated_rig(simulated_pinhole(), 1);
  const Eigen::Vector3d truth(0.3, 0.2, 4);
  auto seen = observe(rig, truth, 4, 0.3, 0.5, random);
  EXPECT_LT(refine_point(rig, seen, truth).worst_chi2, 9);
  seen[1].pixel.y() += 20;
  EXPECT_GT(refine_point(rig, seen, truth).worst_chi2, 100);
}

TEST(PointRefinement, ReportsPointsThatAreNotDetermined) {
  Random random(4);
  const Rig rig = simulated_rig(simulated_pinhole(), 1);
  const Eigen::Vector3d truth(0.3, 0.2, 4), behind(0, 0, -4);
  const auto once = observe(rig, truth, 1, 0.3, 0, random);
  const auto same_place = observe(rig, truth, 1, 0, 0, random);
  auto twice = same_place;
  twice.push_back(same_place[0]);
  EXPECT_FALSE(refine_point(rig, {}, truth).converged);
  EXPECT_FALSE(refine_point(rig, once, truth).converged);
  EXPECT_FALSE(refine_point(rig, twice, truth).converged);
  const auto unseen = refine_point(rig, observe(rig, truth, 3, 0.3, 0, random), behind);
  EXPECT_FALSE(unseen.converged);
  EXPECT_EQ(unseen.point, behind);
  EXPECT_EQ(unseen.worst_chi2, kUnseenChi2);
}

TEST(PointRefinement, RefusesOptionsThatMakeNoSense) {
  const Rig rig = simulated_rig(simulated_pinhole(), 1);
  EXPECT_THROW(refine_point(rig, {}, {0, 0, 1}, {.iterations = 0}), InputError);
}

}  // namespace
}  // namespace rover
