#include "rover/features/aliked_describer.h"

#include <algorithm>
#include <cmath>

namespace rover {
namespace {

constexpr int kPatch = 3, kPixels = kPatch * kPatch, kPositions = 16;

// First row or column of the patch: centred on the whole pixel, shifted to lie within the image.
int patch_corner(float position, int length) {
  return std::clamp(static_cast<int>(std::trunc(std::trunc(position) - 0.5f)), 0, length - 4);
}

}  // namespace

AlikedDescriber::AlikedDescriber(const std::string& name, Runtime& runtime)
    : offsets_(runtime.load(name + "_offsets.onnx")),
      descriptors_(runtime.load(name + "_descriptors.onnx")),
      size_(name == "aliked-t16" ? 64 : 128) {}

Descriptors AlikedDescriber::describe(const AlikedLevels& levels,
                                      const std::vector<Eigen::Vector2f>& positions,
                                      ThreadPool& pool, std::vector<float>& memory) const {
  Descriptors descriptors(static_cast<Eigen::Index>(positions.size()), size_);
  if (positions.empty()) return descriptors;
  const auto patches = gather_patches(levels, positions, pool, memory);
  const auto offsets = offsets_->run({&patches, 1});
  const auto samples = gather_samples(levels, positions, offsets[0].values.data(), pool, memory);
  const auto described = descriptors_->run({&samples, 1});
  std::copy(described[0].values.begin(), described[0].values.end(), descriptors.data());
  return descriptors;
}

// [N, 9, dim]: the joint vectors of 3x3 pixels around each position.
TensorView AlikedDescriber::gather_patches(const AlikedLevels& levels,
                                           const std::vector<Eigen::Vector2f>& positions,
                                           ThreadPool& pool, std::vector<float>& memory) const {
  memory.resize(positions.size() * kPixels * size_);
  pool.parallel_for(positions.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const int x = patch_corner(positions[n].x(), levels.size().width);
      const int y = patch_corner(positions[n].y(), levels.size().height);
      for (int k = 0; k < kPixels; ++k) {
        levels.at_pixel(x + k % kPatch, y + k / kPatch, memory.data() + (n * kPixels + k) * size_);
      }
    }
  });
  return {memory, {static_cast<std::int64_t>(positions.size()), kPixels, size_}};
}

// [N, 16, dim]: joint vectors at each position plus its offsets [N, 16, 2] (px), which may reach a
// quarter of the larger side.
TensorView AlikedDescriber::gather_samples(const AlikedLevels& levels,
                                           const std::vector<Eigen::Vector2f>& positions,
                                           const float* offsets, ThreadPool& pool,
                                           std::vector<float>& memory) const {
  memory.resize(positions.size() * kPositions * size_);
  const auto limit = static_cast<float>(std::max(levels.size().width, levels.size().height)) / 4;
  pool.parallel_for(positions.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin * kPositions; i < end * kPositions; ++i) {
      const auto& position = positions[i / kPositions];
      levels.interpolate(position.x() + std::clamp(offsets[2 * i], -limit, limit),
                         position.y() + std::clamp(offsets[2 * i + 1], -limit, limit),
                         memory.data() + i * size_);
    }
  });
  return {memory, {static_cast<std::int64_t>(positions.size()), kPositions, size_}};
}

}  // namespace rover
