#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace rover {

// What the light does over time.
enum class LightingStyle {
  kConstant,
  kDim,      // a quarter of the usual gray level, with heavy noise
  kFlicker,  // brightness jumps by up to a half several times a second, and drops now and then
  kSweep,    // lamps brighten and dim one after the other
};

// "constant", "dim", "flicker", "sweep". Throws InputError for others.
LightingStyle parse_lighting_style(const std::string& name);

// The weights of the scene's groups of lamps at a time: 1 but for kSweep.
std::vector<float> lamp_weights(LightingStyle style, double seconds);

// By how much all light is multiplied at a time: 1 but for kFlicker. Drawn anew with each seed.
double flicker_factor(LightingStyle style, double seconds, std::uint64_t seed);

struct SensorOptions {
  double mean_gray = 115;               // gray level that the exposure control aims at, 1 to 254
  double full_scale_electrons = 14000;  // that make gray level 255; fewer: noisier
  double read_noise = 25;               // electrons, deviation
  double black_level = 1;               // gray level without light
  double gamma = 1.25;                  // gray = 255 signal^(1 / gamma)
  double vignetting = 0.25;             // light lost in the corners of an image
  double reaction_time = 0.3;           // s that the exposure control lags behind changes of light

  // The same sensor where light is scarce.
  static SensorOptions dim();
  // Throws InputError for values that make no sense.
  void check() const;
};

// Turns radiance into the 8-bit image that a camera delivers. Thread-safe.
class Sensor {
 public:
  Sensor(const SensorOptions& options, cv::Size size);

  // radiance: 32-bit float. gain: from radiance to signal (1 fills a pixel). The same seed gives
  // the same noise.
  cv::Mat expose(const cv::Mat& radiance, double gain, std::uint64_t seed) const;

  // The gain that brings radiance of this mean to the wanted gray level.
  double gain_for(double mean_radiance) const;

 private:
  SensorOptions options_;
  cv::Mat transmission_;         // of the lens, 32-bit float
  std::vector<float> gaussian_;  // deviates to pick from
};

// The mean of an image's radiance as exposure controls take it: highlights cut off.
double metered_mean(const cv::Mat& radiance);

// The gain of each frame from the metered mean of each: the control follows with a lag.
std::vector<double> controlled_gains(const Sensor& sensor, const SensorOptions& options,
                                     const std::vector<double>& means, double frame_interval);

}  // namespace rover
