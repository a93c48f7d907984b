#pragma once

#include <cmath>

namespace rover {

// What an observation whose point its camera cannot see counts as (300 sigmas), and the most that
// any counts as: a constant without gradient, so that a step which pushes a point behind a camera
// is not rewarded.
inline constexpr double kUnseenChi2 = 9e4;

// Huber's kernel on a squared normalised residual s, in the form of Triggs et al., "Bundle
// adjustment - a modern synthesis" (2000), section 4.3: the cost is 0.5 * rho(s), and a residual
// enters the normal equations with weight rho'(s). Residuals up to `threshold` (in sigmas) count
// in full, larger ones grow linearly, up to kUnseenChi2: close to the plane of a pinhole camera,
// distortion polynomials throw points 1e20 px away, and their derivatives with them.
struct HuberKernel {
  double threshold = 0;

  double rho(double s) const {
    if (s <= threshold * threshold) return s;
    return 2 * threshold * std::sqrt(s < kUnseenChi2 ? s : kUnseenChi2) - threshold * threshold;
  }
  double weight(double s) const {
    if (s <= threshold * threshold) return 1;
    return s < kUnseenChi2 ? threshold / std::sqrt(s) : 0;
  }
};

}  // namespace rover
