#pragma once

#include <array>

#include <opencv2/core.hpp>

#include "rover/features/kernels.h"
#include "rover/networks/runtime.h"

namespace rover {

// The joint feature map of ALIKED, never made as a whole (78 MB at 640x480): vectors are joined
// from the four levels where they are asked for (docs/networks.md, ALIKED). Borrows the levels.
class AlikedLevels {
 public:
  // levels: [pixels, C] each. `size`: of the image, whose first pixel is at `origin` of the padded
  // image.
  AlikedLevels(const std::array<const Network::Output*, 4>& levels, cv::Size padded, cv::Size size,
               cv::Point origin, const kernels::Kernels& kernels);

  int channels() const { return 4 * level_channels_; }
  cv::Size size() const { return size_; }

  // The joint unit vector of a pixel inside the image.
  void at_pixel(int x, int y, float* out) const;

  // Interpolated between the joint vectors of the four pixels around; zero outside the image.
  void interpolate(float x, float y, float* out) const;

 private:
  struct Level {
    const float* data;
    int width, height;
    float scale_x, scale_y;  // from the padded image's pixels, corners aligned
  };

  cv::Size size_;
  cv::Point origin_;
  int level_channels_;
  const kernels::Kernels& kernels_;
  std::array<Level, 4> levels_;
};

}  // namespace rover
