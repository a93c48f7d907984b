#include "rover/camera/radial_polynomial.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace rover {
namespace {

double evaluate(const std::vector<double>& polynomial, double x) {
  double value = 0;
  for (auto c = polynomial.rbegin(); c != polynomial.rend(); ++c) value = value * x + *c;
  return value;
}

// The root between two points of different sign.
double bisect(const std::vector<double>& polynomial, double low, double high) {
  const bool low_is_positive = evaluate(polynomial, low) > 0;
  while (true) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return low;
    ((evaluate(polynomial, middle) > 0) == low_is_positive ? low : high) = middle;
  }
}

// All points in (0, limit) where the polynomial (coefficients by rising degree) changes its sign,
// in ascending order: between its derivative's such points it is monotone.
std::vector<double> sign_changes(const std::vector<double>& polynomial, double limit) {
  if (polynomial.size() < 2) return {};
  std::vector<double> derivative;
  for (std::size_t i = 1; i < polynomial.size(); ++i)
    derivative.push_back(static_cast<double>(i) * polynomial[i]);
  std::vector<double> ends = sign_changes(derivative, limit);
  ends.push_back(limit);
  std::vector<double> changes;
  double begin = 0;
  for (const double end : ends) {
    if ((evaluate(polynomial, begin) > 0) != (evaluate(polynomial, end) > 0))
      changes.push_back(bisect(polynomial, begin, end));
    begin = end;
  }
  return changes;
}

}  // namespace

double RadialPolynomial::growing_until(double limit) const {
  const std::vector<double> slope_by_square = {1, 3 * k_[0], 5 * k_[1], 7 * k_[2], 9 * k_[3]};
  const auto changes = sign_changes(slope_by_square, limit * limit);
  return changes.empty() ? std::numeric_limits<double>::infinity() : std::sqrt(changes.front());
}

// Newton's method, kept inside a bracket that shrinks: converges for every growing polynomial.
std::optional<double> RadialPolynomial::invert(double target, double max) const {
  if (!(target >= 0) || !std::isfinite(target)) return std::nullopt;
  double low = 0;
  double high = std::isfinite(max) ? max : std::max(target, 1.0);
  while (value(high) < target) {
    if (high == max) return std::nullopt;
    high *= 2;
  }
  double r = std::min(target, high);
  constexpr int kMaxIterations = 100;
  for (int i = 0; i < kMaxIterations; ++i) {
    const double error = value(r) - target;
    (error > 0 ? high : low) = r;
    double next = r - error / slope(r);
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    const double step = std::abs(next - r);
    r = next;
    if (step <= 4 * std::numeric_limits<double>::epsilon() * r) break;
  }
  return r;
}

}  // namespace rover
