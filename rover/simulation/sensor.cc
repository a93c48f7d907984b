#include "rover/simulation/sensor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rover/base/error.h"
#include "rover/base/random.h"

namespace rover {
namespace {

constexpr int kDeviateBits = 16;

// Normal deviates to pick from at random: much cheaper than drawing a new one for each pixel.
std::vector<float> gaussian_deviates() {
  std::vector<float> values(std::size_t{1} << kDeviateBits);
  Random random(1);
  for (std::size_t i = 0; i < values.size(); i += 2) {
    values[i] = static_cast<float>(random.gaussian());
    values[i + 1] = -values[i];  // mean zero exactly
  }
  return values;
}

cv::Mat lens_transmission(cv::Size size, double lost) {
  cv::Mat transmission(size, CV_32F);
  const double cx = 0.5 * (size.width - 1), cy = 0.5 * (size.height - 1);
  const double corner2 = cx * cx + cy * cy;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double r2 = ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / corner2;
      transmission.at<float>(y, x) = static_cast<float>(1 - lost * r2);
    }
  }
  return transmission;
}

}  // namespace

LightingStyle parse_lighting_style(const std::string& name) {
  if (name == "constant") return LightingStyle::kConstant;
  if (name == "dim") return LightingStyle::kDim;
  if (name == "flicker") return LightingStyle::kFlicker;
  if (name == "sweep") return LightingStyle::kSweep;
  throw InputError("--lighting '{}' is not known; use constant, dim, flicker or sweep", name);
}

std::vector<float> lamp_weights(LightingStyle style, double seconds) {
  constexpr int kGroups = 4;
  std::vector<float> weights(kGroups, 1.0F);
  if (style != LightingStyle::kSweep) return weights;
  constexpr double kPeriod = 6;  // s
  for (int g = 0; g < kGroups; ++g) {
    const double phase = 2 * std::numbers::pi * (seconds / kPeriod - 1.0 * g / kGroups);
    const double wave = 0.5 + 0.5 * std::cos(phase);
    weights[g] = static_cast<float>(0.1 + 2.4 * wave * wave);
  }
  return weights;
}

double flicker_factor(LightingStyle style, double seconds, std::uint64_t seed) {
  if (style != LightingStyle::kFlicker) return 1;
  constexpr double kJumps = 6, kDrops = 0.7;  // per second
  Random jump(hash_seed(seed, static_cast<std::uint64_t>(std::floor(seconds * kJumps)), 11));
  Random drop(hash_seed(seed, static_cast<std::uint64_t>(std::floor(seconds * kDrops)), 12));
  const double factor = jump.uniform(0.65, 1.35);
  const double drop_begin = drop.uniform();
  const double phase = seconds * kDrops - std::floor(seconds * kDrops);
  const bool dropped = phase > drop_begin && phase < drop_begin + 0.15;
  return dropped ? 0.4 * factor : factor;
}

SensorOptions SensorOptions::dim() {
  SensorOptions options;
  options.mean_gray = 30;
  options.full_scale_electrons = 900;
  options.read_noise = 12;
  return options;
}

void SensorOptions::check() const {
  require(mean_gray >= 1 && mean_gray <= 254, "the sensor's mean gray level must lie in 1 .. 254");
  require(full_scale_electrons > 0, "the sensor's full scale must be positive");
  require(read_noise >= 0 && black_level >= 0 && black_level < 100 && reaction_time >= 0,
          "the sensor's noise, black level and reaction time must not be negative");
  require(gamma > 0.2 && gamma < 5, "the sensor's gamma must lie between 0.2 and 5");
  require(vignetting >= 0 && vignetting <= 1, "the sensor's vignetting must lie in 0 .. 1");
}

Sensor::Sensor(const SensorOptions& options, cv::Size size)
    : options_(options),
      transmission_(lens_transmission(size, options.vignetting)),
      gaussian_(gaussian_deviates()) {
  options.check();
}

cv::Mat Sensor::expose(const cv::Mat& radiance, double gain, std::uint64_t seed) const {
  require(radiance.size() == transmission_.size(), "the sensor is of another size than the image");
  const float g = static_cast<float>(gain);
  const float shot = 1 / static_cast<float>(options_.full_scale_electrons);
  const float read = static_cast<float>(options_.read_noise) * shot;
  const float exponent = static_cast<float>(1 / options_.gamma);
  const float black = static_cast<float>(options_.black_level);
  cv::Mat image(radiance.size(), CV_8U);
  for (int y = 0; y < image.rows; ++y) {
    const float* in = radiance.ptr<float>(y);
    const float* lens = transmission_.ptr<float>(y);
    auto* out = image.ptr<std::uint8_t>(y);
    Random random(hash_seed(seed, static_cast<std::uint64_t>(y)));
    for (int x = 0; x < image.cols; ++x) {
      const float signal = g * in[x] * lens[x];
      const float sigma = std::sqrt(signal * shot + read * read);
      const float noisy = signal + sigma * gaussian_[random.bits() >> (64 - kDeviateBits)];
      const float gray = black + (255 - black) * std::pow(std::max(noisy, 0.0F), exponent);
      out[x] = static_cast<std::uint8_t>(std::min(gray + 0.5F, 255.0F));
    }
  }
  return image;
}

double Sensor::gain_for(double mean_radiance) const {
  const double gray = (options_.mean_gray - options_.black_level) / (255 - options_.black_level);
  // Vignetting takes about half of its corner value on average.
  const double transmitted = 1 - 0.33 * options_.vignetting;
  return std::pow(std::max(gray, 0.002), options_.gamma) /
         (std::max(mean_radiance, 1e-4) * transmitted);
}

double metered_mean(const cv::Mat& radiance) {
  const double cap = 2.5 * std::max(1e-4, cv::mean(radiance)[0]);
  const cv::Mat capped = cv::min(radiance, cap);
  return cv::mean(capped)[0];
}

std::vector<double> controlled_gains(const Sensor& sensor, const SensorOptions& options,
                                     const std::vector<double>& means, double frame_interval) {
  std::vector<double> gains;
  const double follow = 1 - std::exp(-frame_interval / std::max(1e-6, options.reaction_time));
  double metered = means.empty() ? 1 : means.front();
  for (const double mean : means) {
    metered += follow * (mean - metered);
    gains.push_back(sensor.gain_for(metered));
  }
  return gains;
}

}  // namespace rover
