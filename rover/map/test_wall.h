#pragma once

#include <Eigen/Dense>
#include <opencv2/core.hpp>

#include "rover/camera/camera.h"
#include "rover/geometry/se3.h"
#include "rover/matching/test_images.h"

namespace rover {

inline const Camera kWallCamera(CameraModel::kPinhole, 200, 160, {250, 250, 100, 80}, {0, 0, 0, 0});
inline const Eigen::Vector3d kWallPoint(0.05, -0.03, 2);  // m, in the reference camera's frame

// A textured wall through kWallPoint, seen by a camera at any pose.
class Wall {
 public:
  Wall(std::uint64_t seed, const Eigen::Vector2d& slant) : texture_(seed, 6, 25, 30) {
    const Eigen::Vector3d ray = kWallPoint.normalized();
    const Eigen::Vector3d down = ray.cross(Eigen::Vector3d::UnitX()).normalized();
    const Eigen::Vector3d right = down.cross(ray);
    normal_ = (ray + slant.x() * right + slant.y() * down).normalized();
    along_ = normal_.cross(Eigen::Vector3d::UnitY()).normalized();
    up_ = normal_.cross(along_);
  }

  Eigen::Vector3d hit(const SE3& reference_from_camera, const Eigen::Vector2d& pixel) const {
    const Eigen::Vector3d from = reference_from_camera.translation;
    const Eigen::Vector3d ray =
        reference_from_camera.rotation * kWallCamera.unproject(pixel).value();
    return from + ray * (normal_.dot(kWallPoint - from) / normal_.dot(ray));
  }

  cv::Mat seen_from(const SE3& reference_from_camera, std::uint64_t seed) const {
    constexpr double kTexels = 125;  // per m: one pixel at 2 m
    return texture_.render(
        {kWallCamera.width(), kWallCamera.height()},
        [&](const Eigen::Vector2d& pixel) {
          const Eigen::Vector3d at = hit(reference_from_camera, pixel) - kWallPoint;
          return Eigen::Vector2d(kTexels * along_.dot(at), kTexels * up_.dot(at));
        },
        1, 0, 2, seed);
  }

 private:
  SmoothTexture texture_;
  Eigen::Vector3d normal_, along_, up_;
};

inline SE3 view_from(double x, double y, double z, double turn) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY())), {x, y, z}};
}

}  // namespace rover
