#include "rover/geometry/absolute_pose.h"

#include <cmath>

#include <gtest/gtest.h>

#include "rover/geometry/random_geometry.h"

namespace rover {
namespace {

constexpr double kSigma = 1.0 / 450;  // rad, as the default options have it

// Bearings within `max_angle` of the axis: 0.6 rad for a pinhole, beyond a right angle for fisheye.
Eigen::Vector3d bearing_in_view(Random& random, double max_angle) {
  while (true) {
    const Eigen::Vector3d d = random_direction(random);
    if (std::acos(d.z()) < max_angle) return d;
  }
}

struct Scene {
  SE3 world_from_body;
  std::vector<SE3> body_from_camera;
  std::vector<PointBearing> seen;
};

Scene make_scene(Random& random, int cameras, int count, double outliers, double sigma,
                 double max_angle) {
  Scene scene{random_pose(random, 10), {}, {}};
  for (int c = 0; c < cameras; ++c) scene.body_from_camera.push_back(random_pose(random, 0.1));
  for (int i = 0; i < count; ++i) {
    const int camera = i % cameras;
    const Eigen::Vector3d bearing = bearing_in_view(random, max_angle);
    const SE3 world_from_camera = scene.world_from_body * scene.body_from_camera[camera];
    const Eigen::Vector3d point = world_from_camera * (random.uniform(1, 15) * bearing);
    const bool outlier = i < outliers * count;
    scene.seen.push_back(
        {point,
         outlier ? bearing_in_view(random, max_angle) : disturb_bearing(bearing, sigma, random),
         camera});
  }
  return scene;
}

Vector6d error_of(const SE3& found, const SE3& truth) { return se3_minus(found, truth); }

TEST(AbsolutePose, IsExactWithoutNoise) {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const Scene scene = make_scene(random, 1, 30, 0, 0, i % 2 ? 0.6 : 1.8);
    const SE3 truth = scene.world_from_body * scene.body_from_camera[0];
    const auto found = estimate_absolute_pose(scene.seen, {.ransac = {.seed = 4}});
    ASSERT_TRUE(found);
    EXPECT_LT(error_of(found->world_from_body, truth).norm(), 1e-8);
    EXPECT_EQ(found->inliers.size(), 30u);
  }
}

TEST(AbsolutePose, FindsThePoseAmongHalfOutliers) {
  Random random(2);
  double rotation = 0, translation = 0, inliers = 0;
  constexpr int kRuns = 300;
  for (int i = 0; i < kRuns; ++i) {
    const Scene scene = make_scene(random, 1, 200, 0.5, kSigma, i % 2 ? 0.6 : 1.8);
    const SE3 truth = scene.world_from_body * scene.body_from_camera[0];
    const auto found = estimate_absolute_pose(scene.seen, {.ransac = {.seed = 1}});
    ASSERT_TRUE(found);
    const Vector6d error = error_of(found->world_from_body, truth);
    EXPECT_LT(error.head<3>().norm(), 0.05);
    EXPECT_LT(error.tail<3>().norm(), 0.01);
    translation += error.head<3>().norm() / kRuns;
    rotation += error.tail<3>().norm() / kRuns;
    EXPECT_NEAR(static_cast<double>(found->inliers.size()), 95, 12);
    inliers += static_cast<double>(found->inliers.size()) / kRuns;
  }
  EXPECT_NEAR(inliers, 95, 1);  // the bound is that of 95%
  EXPECT_LT(translation, 0.006);
  EXPECT_LT(rotation, 0.001);
}

TEST(AbsolutePose, UsesAllCamerasOfARig) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Scene scene = make_scene(random, 2 + i % 3, 240, 0.5, kSigma, 0.6);
    const auto found =
        estimate_absolute_pose(scene.seen, scene.body_from_camera, AbsolutePoseOptions());
    ASSERT_TRUE(found);
    const Vector6d error = error_of(found->world_from_body, scene.world_from_body);
    EXPECT_LT(error.head<3>().norm(), 0.05);
    EXPECT_LT(error.tail<3>().norm(), 0.01);
    EXPECT_GT(found->inliers.size(), 100u);
  }
}

TEST(AbsolutePose, SeventyPercentOutliers) {
  Random random(4);
  for (int i = 0; i < 50; ++i) {
    const Scene scene = make_scene(random, 1, 200, 0.7, kSigma, 0.6);
    const auto found = estimate_absolute_pose(scene.seen, AbsolutePoseOptions());
    ASSERT_TRUE(found);
    const SE3 truth = scene.world_from_body * scene.body_from_camera[0];
    EXPECT_LT(error_of(found->world_from_body, truth).norm(), 0.08);
  }
}

TEST(AbsolutePose, RepeatsItself) {
  Random random(5);
  const Scene scene = make_scene(random, 2, 100, 0.5, kSigma, 0.6);
  const auto a = estimate_absolute_pose(scene.seen, scene.body_from_camera);
  const auto b = estimate_absolute_pose(scene.seen, scene.body_from_camera);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->world_from_body.matrix(), b->world_from_body.matrix());
  EXPECT_EQ(a->inliers, b->inliers);
}

TEST(AbsolutePose, RefusesNonsense) {
  Random random(6);
  for (int i = 0; i < 100; ++i) {
    const Scene scene = make_scene(random, 1, 100, 1.0, kSigma, 0.6);
    EXPECT_FALSE(estimate_absolute_pose(scene.seen, {.min_inliers = 15}));
  }
}

TEST(AbsolutePose, RefusesTooLittleAndCollinear) {
  Random random(7);
  const Scene two = make_scene(random, 1, 2, 0, 0, 0.6);
  EXPECT_FALSE(estimate_absolute_pose(two.seen));
  const Scene spread = make_scene(random, 3, 6, 0, 0, 0.6);  // two for each camera
  EXPECT_FALSE(estimate_absolute_pose(spread.seen, spread.body_from_camera));
  EXPECT_FALSE(estimate_absolute_pose({}));
  std::vector<PointBearing> line;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d point(0.1 * i, 0, 5);
    line.push_back({point, point.normalized()});
  }
  // A line looks the same from all around it.
  EXPECT_FALSE(estimate_absolute_pose(line));
}

TEST(AbsolutePose, RefinementReachesTheLeastError) {
  Random random(8);
  for (int i = 0; i < 300; ++i) {
    const Scene scene = make_scene(random, 2, 40, 0, kSigma, i % 2 ? 0.6 : 1.5);
    std::vector<int> all(scene.seen.size());
    for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<int>(k);
    const auto cost = [&](const SE3& pose) {
      double sum = 0;
      for (const auto& seen : scene.seen) {
        const SE3 camera_from_world = (pose * scene.body_from_camera[seen.camera]).inverse();
        sum += seen.bearing.cross((camera_from_world * seen.point).normalized()).squaredNorm();
      }
      return sum;
    };
    Vector6d shift;
    shift << 0.05 * random_gaussian_vector(random), 0.02 * random_gaussian_vector(random);
    const SE3 found = refine_absolute_pose(scene.seen, scene.body_from_camera,
                                           se3_plus(scene.world_from_body, shift), all, 20);
    for (int axis = 0; axis < 6; ++axis)
      for (const double step : {-1e-4, 1e-4})
        EXPECT_LT(cost(found), cost(se3_plus(found, step * Vector6d::Unit(axis))));
  }
}

TEST(AbsolutePose, OptionsAreChecked) {
  EXPECT_NO_THROW(AbsolutePoseOptions().check());
  EXPECT_THROW(AbsolutePoseOptions{.sigma_px = 0}.check(), InputError);
  EXPECT_THROW(AbsolutePoseOptions{.focal_length = -1}.check(), InputError);
  EXPECT_THROW(AbsolutePoseOptions{.min_inliers = 3}.check(), InputError);
}

}  // namespace
}  // namespace rover
