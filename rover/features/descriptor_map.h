#pragma once

#include <vector>

#include <Eigen/Core>

#include "rover/base/thread_pool.h"
#include "rover/features/feature_set.h"
#include "rover/features/kernels.h"

namespace rover {

// A descriptor per 8x8 cell of an image, to be sampled anywhere. Borrows its memory.
class DescriptorMap {
 public:
  // planes: [channels, height, width] as networks return it, of any length; `cells` is grown to
  // hold the unit vectors [height, width, channels] and must outlive the map.
  DescriptorMap(const float* planes, int channels, int width, int height,
                const kernels::Kernels& kernels, ThreadPool& pool, std::vector<float>& cells);

  // The unit descriptor at a position in px of the image: bilinear between the cells' centres
  // (8 i + 3.5), then normalised. `out` has room for one descriptor.
  void sample(const Eigen::Vector2f& position, float* out) const;

  // One row for each position.
  Descriptors sample(const std::vector<Eigen::Vector2f>& positions, ThreadPool& pool) const;

 private:
  const float* cell(int i, int j) const;

  int channels_, width_, height_;
  const kernels::Kernels& kernels_;
  const float* cells_;
};

}  // namespace rover
