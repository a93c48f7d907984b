#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "rover/camera/camera.h"
#include "rover/simulation/renderer.h"
#include "rover/simulation/scene_rays.h"

namespace rover {

// The rays of a camera's pixels with their slopes, so that one near a pixel's centre costs no
// unprojection.
class CameraRays {
 public:
  explicit CameraRays(const Camera& camera);

  int width() const { return width_; }
  int height() const { return static_cast<int>(pixels_.size()) / width_; }
  float pixel_angle() const { return pixel_angle_; }  // rad, in the middle of the image
  bool valid(int x, int y) const { return !std::isnan(pixels_[index(x, y)].centre.x()); }
  // The ray at (x + dx, y + dy), dx and dy at most half a pixel; of about unit length. A pixel
  // without a ray gives one that is only good for nothing to happen.
  Eigen::Vector3f at(int x, int y, float dx, float dy) const {
    const Pixel& pixel = pixels_[index(x, y)];
    return valid(x, y) ? Eigen::Vector3f(pixel.centre + dx * pixel.by_x + dy * pixel.by_y)
                       : Eigen::Vector3f::UnitZ();
  }

 private:
  struct Pixel {
    Eigen::Vector3f centre, by_x, by_y;
  };
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  int width_;
  float pixel_angle_;
  std::vector<Pixel> pixels_;
};

// Where a camera is while one row is exposed.
class RowPoses {
 public:
  static constexpr int kSlices = 16;

  // Puts a camera's ray into the world, at a slice of the row's exposure, as ray i of a packet.
  void place(int slice, const Eigen::Vector3f& ray, SceneRays::Packet& packet, int i) const {
    const Eigen::Vector3f direction = rotation[slice] * ray;
    packet.ox[i] = origin[slice].x();
    packet.oy[i] = origin[slice].y();
    packet.oz[i] = origin[slice].z();
    packet.dx[i] = direction.x();
    packet.dy[i] = direction.y();
    packet.dz[i] = direction.z();
  }

  std::array<Eigen::Matrix3f, kSlices> rotation;
  std::array<Eigen::Vector3f, kSlices> origin;
};

// Where a camera is while an image is exposed, row by row.
class ShotPoses {
 public:
  ShotPoses(const std::vector<SE3>& world_from_camera, int height, const RenderOptions& options);

  RowPoses row(int y) const;

 private:
  std::vector<Eigen::Matrix3f> rotations_;
  std::vector<Eigen::Vector3f> origins_;
  int height_;
  double exposure_, readout_;
};

// Where in its pixel, and when in the exposure, a sample is taken. Samples of one pixel are spread
// evenly: over a grid of cells, and over the time slices in an order of its own
// for each pixel.
struct SampleJitter {
  SampleJitter(std::uint64_t bits, int sample, int samples);

  float dx, dy;  // px, -0.5 to 0.5
  int time;      // slice
};

}  // namespace rover
