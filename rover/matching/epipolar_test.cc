#include "rover/matching/epipolar.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "rover/base/random.h"

namespace rover {
namespace {

const Camera kPinhole(CameraModel::kPinhole, 752, 480, {458, 457, 367, 248},
                      {-0.283, 0.074, 0.0002, 0.00002});
const Camera kFisheye(CameraModel::kFisheye, 512, 512, {190, 190, 255, 256},
                      {0.003, 0.0007, -0.002, 0.0002});

SE3 some_pose(std::uint64_t seed) {
  Random random(seed);
  Vector6d tangent;
  for (double& value : tangent) value = 0.2 * random.gaussian();
  return se3_exp(tangent);
}

// Points that both cameras see, and their pixels.
struct Scene {
  std::vector<Eigen::Vector2f> in_a, in_b;
};

Scene make_scene(const Camera& a, const Camera& b, const SE3& b_from_a, std::uint64_t seed) {
  Random random(seed);
  Scene scene;
  while (scene.in_a.size() < 100) {
    const Eigen::Vector2d pixel(random.uniform(0, a.width() - 1),
                                random.uniform(0, a.height() - 1));
    const auto ray = a.unproject(pixel);
    if (!ray) continue;
    const auto seen = b.project(b_from_a * (random.uniform(1, 20) * *ray));
    if (!seen || !b.contains(*seen)) continue;
    scene.in_a.emplace_back(pixel.cast<float>());
    scene.in_b.emplace_back(seen->cast<float>());
  }
  return scene;
}

TEST(EpipolarDistance, IsZeroForTruePairsAndPixelsOtherwise) {
  for (const auto& [a, b] : {std::pair(kPinhole, kPinhole), {kPinhole, kFisheye}}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const SE3 pose = some_pose(seed);
      Scene scene = make_scene(a, b, pose, seed);
      const auto rays_a = observe_rays(a, scene.in_a);
      const auto rays_b = observe_rays(b, scene.in_b);
      for (std::size_t i = 0; i < rays_a.size(); ++i) {
        EXPECT_LT(epipolar_distance(rays_a[i], rays_b[i], pose), 1e-3);
        // The direction across the line, found by moving along it: towards another depth.
        const auto along =
            b.project(pose * (8 * rays_a[i].direction), nullptr).value_or(Eigen::Vector2d(0, 0));
        const Eigen::Vector2d line = along - scene.in_b[i].cast<double>();
        if (line.norm() < 1e-2 || line.norm() > 5) continue;  // nearly straight only
        const Eigen::Vector2d across = Eigen::Vector2d(-line.y(), line.x()).normalized();
        const std::vector<Eigen::Vector2f> moved = {scene.in_b[i] + (2 * across).cast<float>()};
        const auto ray = observe_rays(b, moved);
        const Eigen::Vector3d normal =
            pose.translation.cross(pose.rotation * rays_a[i].direction).normalized();
        EXPECT_NEAR(plane_distance(normal, ray[0]), 2, 0.2);
      }
    }
  }
}

TEST(EpipolarInliers, KeepTruePairsInFront) {
  const SE3 pose = some_pose(3);
  const Scene scene = make_scene(kPinhole, kPinhole, pose, 1);
  const auto rays_a = observe_rays(kPinhole, scene.in_a);
  const auto rays_b = observe_rays(kPinhole, scene.in_b);
  std::vector<Match> matches(100);
  for (int i = 0; i < 100; ++i) matches[i] = {i, i % 2 == 0 ? i : (i + 37) % 100, 1};
  const auto inliers = epipolar_inliers(matches, rays_a, rays_b, pose, 1);
  int correct = 0;
  for (const Match& m : inliers) correct += m.a == m.b;
  EXPECT_EQ(correct, 50);
  EXPECT_LT(inliers.size(), 56u);
  // The opposite motion has the same lines, but sees the points behind.
  SE3 opposite = pose;
  opposite.translation = -pose.translation;
  EXPECT_LT(epipolar_inliers(matches, rays_a, rays_b, opposite, 1).size(), 6u);
}

TEST(EpipolarDistance, SaysWhenThereIsNoRay) {
  const Camera barrel(CameraModel::kPinhole, 752, 480, {458, 457, 367, 248}, {-0.3, 0, 0, 0});
  const std::vector<Eigen::Vector2f> far_out = {{1e4f, 1e4f}};
  const auto rays = observe_rays(barrel, far_out);
  EXPECT_FALSE(rays[0].valid);
  EXPECT_GT(epipolar_distance(rays[0], rays[0], some_pose(1)), 1e300);
}

}  // namespace
}  // namespace rover
