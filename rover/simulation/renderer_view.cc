#include "rover/simulation/renderer_view.h"

#include <algorithm>
#include <limits>

namespace rover {
namespace {

using Eigen::Vector3f;

float fraction(std::uint64_t bits, int shift) {
  return static_cast<float>((bits >> shift) & 0xffff) / 65536.0F;
}

}  // namespace

CameraRays::CameraRays(const Camera& camera)
    : width_(camera.width()),
      pixel_angle_(static_cast<float>(1 / camera.focal_length())),
      pixels_(static_cast<std::size_t>(camera.width()) *
              static_cast<std::size_t>(camera.height())) {
  const Vector3f none = Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  for (int y = 0; y < camera.height(); ++y) {
    for (int x = 0; x < width_; ++x) {
      const auto centre = camera.unproject({x, y});
      const auto left = camera.unproject({x - 0.5, y}), right = camera.unproject({x + 0.5, y});
      const auto above = camera.unproject({x, y - 0.5}), below = camera.unproject({x, y + 0.5});
      const bool all = centre && left && right && above && below;
      Pixel& pixel = pixels_[index(x, y)];
      pixel.centre = all ? Vector3f(centre->cast<float>()) : none;
      if (!all) continue;
      pixel.by_x = (*right - *left).cast<float>();
      pixel.by_y = (*below - *above).cast<float>();
    }
  }
}

ShotPoses::ShotPoses(const std::vector<SE3>& world_from_camera, int height,
                     const RenderOptions& options)
    : height_(height), exposure_(options.exposure), readout_(options.readout) {
  for (const SE3& pose : world_from_camera) {
    rotations_.push_back(pose.rotation_matrix().cast<float>());
    origins_.push_back(pose.translation.cast<float>());
  }
}

RowPoses ShotPoses::row(int y) const {
  const double span = exposure_ + readout_;
  const double row = height_ > 1 ? static_cast<double>(y) / (height_ - 1) : 0.5;
  RowPoses poses;
  for (int i = 0; i < RowPoses::kSlices; ++i) {
    const double slice = (i + 0.5) / RowPoses::kSlices;
    const double at = (row * readout_ + slice * exposure_) / span;  // 0 to 1
    const double place = at * static_cast<double>(rotations_.size() - 1);
    const auto before = std::min(static_cast<std::size_t>(place), rotations_.size() - 2);
    const float rest = static_cast<float>(place - static_cast<double>(before));
    poses.rotation[i] = (1 - rest) * rotations_[before] + rest * rotations_[before + 1];
    poses.origin[i] = (1 - rest) * origins_[before] + rest * origins_[before + 1];
  }
  return poses;
}

SampleJitter::SampleJitter(std::uint64_t bits, int sample, int samples) {
  const int columns = static_cast<int>(std::sqrt(static_cast<float>(samples)));
  const int rows = samples / columns;
  const bool in_grid = sample < rows * columns;
  const float u = fraction(bits, 0), v = fraction(bits, 16);
  const float column = static_cast<float>(sample % columns),
              row = static_cast<float>(sample / columns);
  dx = (in_grid ? (column + u) / static_cast<float>(columns) : u) - 0.5F;
  dy = (in_grid ? (row + v) / static_cast<float>(rows) : v) - 0.5F;
  const float stratum =
      (static_cast<float>(sample) + fraction(bits, 32)) / static_cast<float>(samples);
  time = std::min(static_cast<int>(stratum * RowPoses::kSlices), RowPoses::kSlices - 1);
}

}  // namespace rover
