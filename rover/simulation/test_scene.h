#pragma once

#include <cmath>
#include <vector>

#include "rover/base/thread_pool.h"
#include "rover/simulation/motion.h"
#include "rover/simulation/scene.h"
#include "rover/simulation/scene_rays.h"

namespace rover {

// A dark box open to the back, 6 m wide, 4 m high, its far side at z = 2.5, with bright dots whose
// places are known. The world is the camera frame of a camera in the origin: z forward, y down.
struct DotScene {
  Scene scene;
  std::vector<Eigen::Vector3d> dots;
  std::vector<Eigen::Vector3d> normals;  // of the surface at each dot
};

inline cv::Mat dots_texture(const Patch& patch, double texel, double spacing, DotScene& scene) {
  const cv::Size size(static_cast<int>(std::lround(patch.edge_u.norm() / texel)),
                      static_cast<int>(std::lround(patch.edge_v.norm() / texel)));
  cv::Mat image(size, CV_8U, cv::Scalar(0));
  const int step = static_cast<int>(spacing / texel), reach = static_cast<int>(0.045 / texel);
  const double sigma = 0.012 / texel;
  for (int cy = step / 2; cy < size.height; cy += step) {
    for (int cx = step / 2; cx < size.width; cx += step) {
      for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
          image.at<std::uint8_t>(cy + y, cx + x) = static_cast<std::uint8_t>(
              std::lround(255 * std::exp(-0.5 * (x * x + y * y) / (sigma * sigma))));
        }
      }
      const auto u = static_cast<float>((cx + 0.5) / size.width);
      const auto v = static_cast<float>((cy + 0.5) / size.height);
      scene.dots.push_back((patch.origin + u * patch.edge_u + v * patch.edge_v).cast<double>());
      scene.normals.push_back(patch.normal().cast<double>());
    }
  }
  return image;
}

inline DotScene make_dot_scene(double spacing) {
  DotScene result;
  Scene& scene = result.scene;
  const auto add = [&](Eigen::Vector3f origin, Eigen::Vector3f right, Eigen::Vector3f down) {
    Patch patch;
    patch.origin = origin;
    patch.edge_u = right;
    patch.edge_v = down;
    patch.emission = 1;
    patch.texture = static_cast<int>(scene.textures.size());
    constexpr double kTexel = 0.002;
    scene.textures.emplace_back(dots_texture(patch, kTexel, spacing, result), kTexel);
    scene.patches.push_back(patch);
  };
  add({-3, -2, 2.5F}, {6, 0, 0}, {0, 4, 0});
  add({-3, -2, -0.5F}, {0, 0, 3}, {0, 4, 0});
  add({3, -2, 2.5F}, {0, 0, -3}, {0, 4, 0});
  add({-3, 2, 2.5F}, {6, 0, 0}, {0, 0, -3});
  scene.ambient = 0;
  ThreadPool pool(1);
  scene.lighting = Lighting(scene, SceneRays(scene.patches), 1, 1, pool);
  return result;
}

// Straight on at constant speed, without turning.
class StraightMotion final : public Motion {
 public:
  StraightMotion(double duration, const Eigen::Vector3d& velocity)
      : duration_(duration), velocity_(velocity) {}
  double begin() const override { return 0; }
  double end() const override { return duration_; }
  MotionState at(double seconds) const override {
    MotionState state;
    state.world_from_body.translation = (seconds - duration_ / 2) * velocity_;
    state.velocity = velocity_;
    return state;
  }

 private:
  double duration_;
  Eigen::Vector3d velocity_;
};

}  // namespace rover
