#include "rover/geometry/triangulation.h"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "rover/base/error.h"
#include "rover/geometry/random_geometry.h"

namespace rover {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Cameras anywhere, bearings in every direction: as good for a fisheye as for a pinhole.
std::vector<ViewRay> views_of(const Eigen::Vector3d& point, int count, double spread, double sigma,
                              Random& random) {
  std::vector<ViewRay> rays;
  for (int i = 0; i < count; ++i) {
    const SE3 pose = random_pose(random, spread);
    const Eigen::Vector3d bearing = (pose.inverse() * point).normalized();
    rays.push_back({pose, disturb_bearing(bearing, sigma, random)});
  }
  return rays;
}

TEST(Triangulation, FindsExactPoints) {
  Random random(1);
  int found = 0;
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector3d point = std::exp(random.uniform(0, 4)) * random_direction(random);
    const auto rays = views_of(point, 2 + i % 5, 1, 0, random);
    const auto result = triangulate(rays);
    if (parallax_angle(rays) <= TriangulationOptions().min_parallax) {
      EXPECT_FALSE(result);
      continue;
    }
    ++found;
    ASSERT_TRUE(result);
    EXPECT_LT((result->point - point).norm(), 1e-10 * point.norm() / result->parallax);
    EXPECT_DOUBLE_EQ(result->parallax, parallax_angle(rays));
    EXPECT_LT(result->max_error, 1e-12);
  }
  EXPECT_GT(found, 4500);
}

// With noise, errors divided by their predicted deviation are chi-square with 3 degrees of freedom:
// their mean is 3.
TEST(Triangulation, PredictsItsError) {
  Random random(2);
  constexpr double kSigma = 1e-3;
  double sum = 0;
  int count = 0;
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector3d point = 5 * random_direction(random);
    const auto result = triangulate(views_of(point, 2 + i % 6, 1, kSigma, random),
                                    {.min_parallax = 0.05, .max_error = kInfinity});
    if (!result) continue;
    const Eigen::Vector3d error = (result->point - point) / kSigma;
    sum += error.dot(result->unit_covariance.inverse() * error);
    ++count;
  }
  EXPECT_GT(count, 4000);
  EXPECT_NEAR(sum / count, 3, 0.15);
}

TEST(Triangulation, RefinementReachesTheLeastAngles) {
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d point = 4 * random_direction(random);
    const auto rays = views_of(point, 4, 1, 5e-3, random);
    const TriangulationOptions options = {
        .min_parallax = 0.1, .max_error = kInfinity, .max_iterations = 20};
    const auto best = triangulate(rays, options);
    if (!best) continue;
    const auto cost = [&](const Eigen::Vector3d& p) {
      double sum = 0;
      for (const auto& ray : rays)
        sum += ray.bearing.cross((ray.world_from_camera.inverse() * p).normalized()).squaredNorm();
      return sum;
    };
    for (int axis = 0; axis < 3; ++axis)
      for (const double step : {-1e-3, 1e-3})
        EXPECT_LT(cost(best->point), cost(best->point + step * Eigen::Vector3d::Unit(axis)));
  }
}

TEST(Triangulation, RefusesParallelRays) {
  Random random(4);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d direction = random_direction(random);
    const SE3 a = random_pose(random), b = random_pose(random);
    const std::vector<ViewRay> rays = {{a, a.rotation.conjugate() * direction},
                                       {b, b.rotation.conjugate() * direction}};
    EXPECT_FALSE(triangulate(rays));
    EXPECT_FALSE(triangulate(rays, {.min_parallax = 0}));
  }
}

// Turning on the spot shows no depth, whatever the noise makes of it.
TEST(Triangulation, RefusesPureRotation) {
  Random random(5);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d centre = random_gaussian_vector(random), d = random_direction(random);
    std::vector<ViewRay> rays;
    for (int k = 0; k < 3; ++k) {
      const SE3 pose(random_rotation(random), centre);
      rays.push_back({pose, disturb_bearing(pose.rotation.conjugate() * d, 5e-4, random)});
    }
    EXPECT_FALSE(triangulate(rays));
  }
}

TEST(Triangulation, RefusesPointsOnTheBaselineAndBehind) {
  const SE3 left, right(Eigen::Quaterniond::Identity(), {1, 0, 0});
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  EXPECT_FALSE(triangulate(std::vector<ViewRay>{{left, x}, {right, -x}}));
  EXPECT_FALSE(triangulate(std::vector<ViewRay>{{left, x}, {right, x}}));
  // Rays that part in front of the cameras and meet behind them.
  const Eigen::Vector3d to_left = Eigen::Vector3d(-0.1, 0, 1).normalized();
  const Eigen::Vector3d to_right = Eigen::Vector3d(0.1, 0, 1).normalized();
  EXPECT_FALSE(triangulate(std::vector<ViewRay>{{left, to_left}, {right, to_right}}));
  EXPECT_TRUE(triangulate(std::vector<ViewRay>{{left, to_right}, {right, to_left}}));
}

TEST(Triangulation, RefusesRaysThatPassEachOther) {
  const SE3 left, right(Eigen::Quaterniond::Identity(), {1, 0, 0});
  const Eigen::Vector3d up = Eigen::Vector3d(0.1, -0.05, 1).normalized();
  const Eigen::Vector3d down = Eigen::Vector3d(-0.1, 0.05, 1).normalized();
  const std::vector<ViewRay> rays = {{left, up}, {right, down}};
  EXPECT_FALSE(triangulate(rays));
  EXPECT_TRUE(triangulate(rays, {.max_error = 0.1}));
}

TEST(Triangulation, RefusesFewerThanTwoRays) {
  EXPECT_FALSE(triangulate({}));
  EXPECT_FALSE(triangulate(std::vector<ViewRay>{{SE3(), Eigen::Vector3d::UnitZ()}}));
  EXPECT_EQ(parallax_angle({}), 0);
}

TEST(Triangulation, OptionsAreChecked) {
  EXPECT_NO_THROW(TriangulationOptions().check());
  EXPECT_THROW(TriangulationOptions{.min_parallax = -1}.check(), InputError);
  EXPECT_THROW(TriangulationOptions{.max_error = 0}.check(), InputError);
  EXPECT_THROW(TriangulationOptions{.max_iterations = -1}.check(), InputError);
}

}  // namespace
}  // namespace rover
