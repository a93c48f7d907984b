#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace rover {

// How much light each spot of a surface gives back: an image with its levels of halved resolution
// (mip map), so that it can be sampled at any distance without aliasing. Immutable.
class Texture {
 public:
  // albedo: 8 bit, one channel, 255 for a surface that gives back all light; not empty.
  // texel: edge length of its pixels on the surface, metres.
  Texture(const cv::Mat& albedo, double texel);

  float texel() const { return texel_; }
  std::size_t bytes() const { return data_.size(); }

  // The albedo, 0 to 1, at (u, v) in [0, 1] x [0, 1] from the upper left to the lower right corner
  // of the image, averaged over some 2^level texels; trilinear.
  float sample(float u, float v, float level) const;

 private:
  struct Level {
    int width, height;
    std::size_t offset;
  };
  float bilinear(const Level& level, float u, float v) const;

  float texel_;
  std::vector<Level> levels_;
  std::vector<std::uint8_t> data_;
};

}  // namespace rover
