#pragma once

#include <Eigen/Core>

namespace rover {

// Uniform B-splines of order 6 (degree 5): four times continuously differentiable.
constexpr int kSplineOrder = 6;

// How much each of the six control points that shape a knot interval counts at one time in it, and
// the first two derivatives of these weights with respect to time. Cumulative weights are those of
// the differences of neighbouring control points; the first of them is always 1.
struct SplineBasis {
  using Weights = Eigen::Matrix<double, kSplineOrder, 1>;
  Weights value, first, second;

  // u: position in the knot interval, in [0, 1]; knot_interval in s.
  static SplineBasis at(double u, double knot_interval);
  // Entry j is the sum of the entries from j on.
  SplineBasis cumulative() const;
};

}  // namespace rover
