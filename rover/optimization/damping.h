#pragma once

#include <algorithm>
#include <cmath>

namespace rover {

// The damping factor of Levenberg and Marquardt's method, after Nielsen, "Damping parameter in
// Marquardt's method" (1999): shrinks smoothly with the gain ratio (actual by predicted decrease of
// the cost) of steps taken, and grows ever faster while steps are refused.
class Damping {
 public:
  explicit Damping(double lambda = 1e-4) : lambda_(lambda) {}

  double lambda() const { return lambda_; }
  bool exhausted() const { return lambda_ > 1e12; }

  void accept(double gain_ratio) {
    const double x = 2 * gain_ratio - 1;
    lambda_ = std::max(1e-15, lambda_ * std::max(1.0 / 3, 1 - x * x * x));
    growth_ = 2;
  }
  void reject() {
    lambda_ *= growth_;
    growth_ *= 2;
  }

  // What is added to a diagonal element of the normal equations: proportional to it, and above zero
  // for unknowns that nothing observes.
  double of(double diagonal) const { return lambda_ * std::max(diagonal, 1e-6); }

 private:
  double lambda_;
  double growth_ = 2;
};

}  // namespace rover
