#pragma once

#include <cmath>

namespace rover {

// Huber's kernel on a squared normalised residual s, in the form of Triggs et al., "Bundle
// adjustment - a modern synthesis" (2000), section 4.3: the cost is 0.5 * rho(s), and a residual
// enters the normal equations with weight rho'(s). Residuals up to `threshold` (in sigmas) count
// in full, larger ones grow linearly.
struct HuberKernel {
  double threshold = 0;

  double rho(double s) const {
    const double limit = threshold * threshold;
    return s <= limit ? s : 2 * threshold * std::sqrt(s) - limit;
  }
  double weight(double s) const {
    return s <= threshold * threshold ? 1.0 : threshold / std::sqrt(s);
  }
};

// What an observation whose point its camera cannot see counts as (100 sigmas): a constant without
// gradient, so that a step which pushes points behind a camera is not rewarded.
inline constexpr double kUnseenChi2 = 1e4;

}  // namespace rover
