#include "rover/features/adaptive_threshold.h"

#include <algorithm>
#include <cmath>

#include "rover/base/error.h"

namespace rover {

void AdaptiveThresholdOptions::check() const {
  require(mu1 >= 0, "adaptive threshold: mu1 must not be negative, but is {}", mu1);
  require(mu2 >= 0, "adaptive threshold: mu2 must not be negative, but is {}", mu2);
  require(min_features >= 0, "adaptive threshold: min_features must not be negative, but is {}",
          min_features);
  require(low <= high, "adaptive threshold: low {} is above high {}", low, high);
}

float adaptive_threshold(std::span<const float> scores, int matches,
                         const AdaptiveThresholdOptions& options) {
  if (!options.enabled || scores.empty()) return options.low;
  double sum = 0, squares = 0;
  for (const double score : scores) {
    sum += score;
    squares += score * score;
  }
  const double count = static_cast<double>(scores.size());
  const double mean = sum / count;
  const double sigma = std::sqrt(std::max(0.0, squares / count - mean * mean));
  const double raised =
      options.mu1 / (1 + std::exp(-options.mu2 * static_cast<float>(std::max(matches, 0))));
  const double threshold = mean + sigma * (0.5 + raised);
  return std::clamp(static_cast<float>(threshold), options.low, options.high);
}

}  // namespace rover
