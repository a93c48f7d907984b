#include "rover/simulation/texture.h"

#include <algorithm>

#include <opencv2/imgproc.hpp>

#include "rover/base/error.h"

namespace rover {

Texture::Texture(const cv::Mat& albedo, double texel) : texel_(static_cast<float>(texel)) {
  require(!albedo.empty() && albedo.type() == CV_8UC1, "a texture needs an 8-bit gray image");
  cv::Mat image = albedo;
  for (;;) {
    levels_.push_back({image.cols, image.rows, data_.size()});
    for (int y = 0; y < image.rows; ++y) {
      data_.insert(data_.end(), image.ptr(y), image.ptr(y) + image.cols);
    }
    if (image.cols == 1 && image.rows == 1) break;
    cv::Mat half;
    cv::resize(image, half, {std::max(1, image.cols / 2), std::max(1, image.rows / 2)}, 0, 0,
               cv::INTER_AREA);
    image = half;
  }
  data_.shrink_to_fit();
}

float Texture::bilinear(const Level& level, float u, float v) const {
  const float x = std::clamp(u * static_cast<float>(level.width) - 0.5F, 0.0F,
                             static_cast<float>(level.width - 1));
  const float y = std::clamp(v * static_cast<float>(level.height) - 0.5F, 0.0F,
                             static_cast<float>(level.height - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const int right = x0 + 1 < level.width ? 1 : 0;
  const int below = y0 + 1 < level.height ? level.width : 0;
  const std::uint8_t* p = data_.data() + level.offset +
                          static_cast<std::size_t>(y0) * static_cast<std::size_t>(level.width) +
                          static_cast<std::size_t>(x0);
  const float top = p[0] + fx * static_cast<float>(p[right] - p[0]);
  const float bottom = p[below] + fx * static_cast<float>(p[below + right] - p[below]);
  return top + fy * (bottom - top);
}

float Texture::sample(float u, float v, float level) const {
  constexpr float kScale = 1.0F / 255;
  const float last = static_cast<float>(levels_.size() - 1);
  const float clamped = std::clamp(level, 0.0F, last);
  const int lower = static_cast<int>(clamped);
  const float fraction = clamped - static_cast<float>(lower);
  const float fine = bilinear(levels_[lower], u, v);
  if (fraction == 0) return kScale * fine;
  const float coarse = bilinear(levels_[lower + 1], u, v);
  return kScale * (fine + fraction * (coarse - fine));
}

}  // namespace rover
