#include "rover/features/aliked_levels.h"

#include <algorithm>
#include <cmath>

namespace rover {
namespace {

constexpr std::array kFactors = {1, 2, 8, 32};
constexpr int kMaxChannels = 128;

// Corners aligned: the first and the last pixel of both maps coincide.
float aligned_scale(int coarse, int fine) {
  return static_cast<float>(coarse - 1) / static_cast<float>(fine - 1);
}

struct Bilinear {
  Bilinear(float x, float y)
      : i(static_cast<int>(std::floor(x))), j(static_cast<int>(std::floor(y))) {
    const float s = x - static_cast<float>(i), t = y - static_cast<float>(j);
    weights = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
  }
  int i, j;
  std::array<float, 4> weights;  // of (i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)
};

}  // namespace

AlikedLevels::AlikedLevels(const std::array<const Network::Output*, 4>& levels, cv::Size padded,
                           cv::Size size, cv::Point origin, const kernels::Kernels& kernels)
    : size_(size),
      origin_(origin),
      level_channels_(static_cast<int>(levels[0]->shape[1])),
      kernels_(kernels) {
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const int width = padded.width / kFactors[k], height = padded.height / kFactors[k];
    levels_[k] = {levels[k]->values.data(), width, height, aligned_scale(width, padded.width),
                  aligned_scale(height, padded.height)};
  }
}

void AlikedLevels::at_pixel(int x, int y, float* out) const {
  for (const Level& level : levels_) {
    const Bilinear b(static_cast<float>(x + origin_.x) * level.scale_x,
                     static_cast<float>(y + origin_.y) * level.scale_y);
    const int right = std::min(b.i + 1, level.width - 1);
    const int below = std::min(b.j + 1, level.height - 1);
    const auto pixel = [&](int i, int j) {
      return level.data + (static_cast<std::ptrdiff_t>(j) * level.width + i) * level_channels_;
    };
    const float* around[] = {pixel(b.i, b.j), pixel(right, b.j), pixel(b.i, below),
                             pixel(right, below)};
    // The finest level has no pixels in between: one of the four is all of it.
    const bool whole = level.width == levels_[0].width;
    const float one = 1;
    const float* itself = pixel(x + origin_.x, y + origin_.y);
    kernels_.blend(whole ? &itself : around, whole ? &one : b.weights.data(), whole ? 1 : 4,
                   level_channels_, out);
    out += level_channels_;
  }
  kernels_.normalize(out - channels(), channels());
}

void AlikedLevels::interpolate(float x, float y, float* out) const {
  const Bilinear b(x, y);
  float vectors[4][kMaxChannels];
  const float* used[4];
  float weights[4];
  int count = 0;
  for (int k = 0; k < 4; ++k) {
    const int px = b.i + k % 2, py = b.j + k / 2;
    if (px < 0 || py < 0 || px >= size_.width || py >= size_.height) continue;
    at_pixel(px, py, vectors[count]);
    used[count] = vectors[count];
    weights[count++] = b.weights[k];
  }
  kernels_.blend(used, weights, count, channels(), out);
}

}  // namespace rover
