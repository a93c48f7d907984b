#include "rover/geometry/homography.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "rover/geometry/two_view_scenes.h"

namespace rover {
namespace {

using namespace two_view_scenes;

TEST(Essential, DecompositionHoldsThePose) {
  Random random(10);
  for (int i = 0; i < 3000; ++i) {
    const SE3 pose(random_rotation(random), random_direction(random));
    const auto poses = decompose_essential(random.uniform(-2, 2) * essential_from_pose(pose));
    double nearest = 10;
    for (const SE3& p : poses) {
      nearest = std::min(nearest, (p.matrix() - pose.matrix()).norm());
      const Eigen::Matrix3d e = essential_from_pose(p), truth = essential_from_pose(pose);
      EXPECT_LT(std::min((e - truth).norm(), (e + truth).norm()), 1e-10);
    }
    EXPECT_LT(nearest, 1e-10);
  }
}

// Divided by the variance of the noise, the errors are chi-square: their means are 1 and 2.
TEST(Essential, ErrorsAreChiSquare) {
  Random random(11);
  for (const View view : {kPinhole, kFisheye}) {
    const Scene scene =
        make_scene(random, random_motion(random, 1), cloud(random), view, 20000, 0, kSigma);
    double sum = 0;
    for (const auto& pair : scene.pairs)
      sum += epipolar_squared_error(essential_from_pose(scene.second_from_first), pair);
    EXPECT_NEAR(sum / (20000 * kSigma * kSigma), 1, 0.05);
  }
}

Eigen::Matrix3d homography_of(const SE3& pose, const Eigen::Vector3d& normal, double d) {
  return pose.rotation_matrix() + pose.translation * normal.transpose() / d;
}

TEST(Homography, ErrorsAreChiSquare) {
  Random random(12);
  for (const View view : {kPinhole, kFisheye}) {
    const SE3 motion = sideways(random, 1);
    const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.2, 1).normalized();
    const Scene scene = make_scene(random, motion, plane(normal, 3), view, 20000, 0, kSigma);
    double sum = 0;
    for (const auto& pair : scene.pairs)
      sum += homography_squared_error(homography_of(motion, normal, 3), pair);
    EXPECT_NEAR(sum / (20000 * kSigma * kSigma), 2, 0.1);
  }
}

TEST(Homography, SolvesAndDecomposes) {
  Random random(13);
  for (int i = 0; i < 2000; ++i) {
    const SE3 motion = sideways(random, 1);
    const Eigen::Vector3d normal =
        (Eigen::Vector3d::UnitZ() + 0.3 * random_gaussian_vector(random)).normalized();
    const Scene scene = make_scene(random, motion, plane(normal, 4), kPinhole, 4 + i % 9, 0, 0);
    const auto found = solve_homography(scene.pairs);
    ASSERT_TRUE(found);
    const Eigen::Matrix3d truth = homography_of(motion, normal, 4);
    for (const auto& pair : scene.pairs) EXPECT_LT(homography_squared_error(*found, pair), 1e-12);
    double nearest = 10;
    for (const SE3& pose : decompose_homography(truth)) {
      EXPECT_NEAR(pose.rotation.norm(), 1, 1e-12);
      nearest = std::min(nearest, (pose.matrix() - motion.matrix()).norm());
    }
    EXPECT_LT(nearest, 1e-6);
  }
}

TEST(Homography, OfARotationShowsNoTranslation) {
  EXPECT_TRUE(decompose_homography(Eigen::Matrix3d::Identity()).empty());
}

TEST(Homography, RefusesPointsOnALine) {
  Random random(14);
  for (int i = 0; i < 500; ++i) {
    const SE3 motion = sideways(random, 1);
    std::vector<BearingPair> pairs;
    const Eigen::Vector3d start(0, 0, 5), d = random_direction(random);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d p = start + 0.5 * k * d;
      pairs.push_back({p.normalized(), (motion * p).normalized()});
    }
    EXPECT_FALSE(solve_homography(pairs));
    const Eigen::Vector3d off(0.7, -0.8, 4);
    pairs.push_back({off.normalized(), (motion * off).normalized()});
    EXPECT_FALSE(solve_homography(pairs));
  }
}

}  // namespace
}  // namespace rover
