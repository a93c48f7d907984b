#pragma once

#include <array>
#include <optional>

namespace rover {

// The odd polynomial r -> r (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8) that both camera models bend
// their rays with: r is the radius in the normalised plane (pinhole) or the angle in rad (fisheye).
class RadialPolynomial {
 public:
  explicit RadialPolynomial(const std::array<double, 4>& coefficients) : k_(coefficients) {}

  double value(double r) const { return r * factor(r * r); }
  // value(r) / r and its derivative by r^2, given r^2.
  double factor(double squared) const {
    return 1 + squared * (k_[0] + squared * (k_[1] + squared * (k_[2] + squared * k_[3])));
  }
  double factor_slope(double squared) const {
    return k_[0] + squared * (2 * k_[1] + squared * (3 * k_[2] + squared * 4 * k_[3]));
  }
  double slope(double r) const { return factor(r * r) + 2 * r * r * factor_slope(r * r); }

  // The largest radius up to which the polynomial grows; infinity if it grows beyond `limit`.
  double growing_until(double limit) const;

  // The r in [0, max] with value(r) == target, where the polynomial grows on [0, max] (max may be
  // infinite). Nothing if the target is beyond value(max) or not finite.
  std::optional<double> invert(double target, double max) const;

 private:
  std::array<double, 4> k_;
};

}  // namespace rover
