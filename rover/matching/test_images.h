#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "rover/base/random.h"

namespace rover {

// A smooth random texture defined everywhere, for tests: images of it can be rendered at any shift
// and warp without interpolation.
class SmoothTexture {
 public:
  // Wavelengths in px; the gray values spread by about `contrast` around 128.
  explicit SmoothTexture(std::uint64_t seed, double shortest = 6, double longest = 30,
                         double contrast = 40) {
    Random random(seed);
    constexpr int kWaves = 24;
    for (int i = 0; i < kWaves; ++i) {
      const double frequency = 2 * M_PI / random.uniform(shortest, longest);
      const double direction = random.uniform(0, 2 * M_PI);
      waves_.push_back({frequency * std::cos(direction), frequency * std::sin(direction),
                        random.uniform(0, 2 * M_PI), contrast * std::sqrt(2.0 / kWaves)});
    }
  }

  double operator()(double x, double y) const {
    double value = 128;
    for (const Wave& w : waves_) value += w.amplitude * std::sin(w.fx * x + w.fy * y + w.phase);
    return value;
  }

  // pixel (x, y) = gain * texture(texture_from_pixel(x, y)) + bias + gaussian noise.
  template <class Map>
  cv::Mat render(cv::Size size, const Map& texture_from_pixel, double gain = 1, double bias = 0,
                 double noise = 0, std::uint64_t seed = 1) const {
    cv::Mat image(size, CV_8UC1);
    Random random(seed);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const Eigen::Vector2d at = texture_from_pixel(Eigen::Vector2d(x, y));
        const double jitter = noise > 0 ? noise * random.gaussian() : 0;
        const double value = gain * (*this)(at.x(), at.y()) + bias + jitter;
        image.at<std::uint8_t>(y, x) =
            static_cast<std::uint8_t>(std::clamp(std::round(value), 0.0, 255.0));
      }
    }
    return image;
  }

 private:
  struct Wave {
    double fx, fy, phase, amplitude;
  };
  std::vector<Wave> waves_;
};

}  // namespace rover
