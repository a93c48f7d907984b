#include "rover/features/descriptor_map.h"

#include <algorithm>
#include <cmath>

namespace rover {

DescriptorMap::DescriptorMap(const float* planes, int channels, int width, int height,
                             const kernels::Kernels& kernels, ThreadPool& pool,
                             std::vector<float>& cells)
    : channels_(channels), width_(width), height_(height), kernels_(kernels) {
  const int count = width * height;
  cells.resize(static_cast<std::size_t>(count) * channels);
  pool.parallel_for(static_cast<std::size_t>(height), [&](std::size_t begin, std::size_t end) {
    kernels.normalize_cells(planes, channels, count, static_cast<int>(begin) * width,
                            static_cast<int>(end) * width, cells.data());
  });
  cells_ = cells.data();
}

const float* DescriptorMap::cell(int i, int j) const {
  const int x = std::clamp(i, 0, width_ - 1), y = std::clamp(j, 0, height_ - 1);
  return cells_ + static_cast<std::ptrdiff_t>(y * width_ + x) * channels_;
}

void DescriptorMap::sample(const Eigen::Vector2f& position, float* out) const {
  const float u = (position.x() - 3.5f) / 8, v = (position.y() - 3.5f) / 8;
  const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
  const float s = u - static_cast<float>(i), t = v - static_cast<float>(j);
  const float* corners[] = {cell(i, j), cell(i + 1, j), cell(i, j + 1), cell(i + 1, j + 1)};
  const float weights[] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
  kernels_.blend(corners, weights, 4, channels_, out);
  kernels_.normalize(out, channels_);
}

Descriptors DescriptorMap::sample(const std::vector<Eigen::Vector2f>& positions,
                                  ThreadPool& pool) const {
  Descriptors descriptors(static_cast<Eigen::Index>(positions.size()), channels_);
  pool.parallel_for(positions.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      sample(positions[i], descriptors.row(static_cast<Eigen::Index>(i)).data());
    }
  });
  return descriptors;
}

}  // namespace rover
