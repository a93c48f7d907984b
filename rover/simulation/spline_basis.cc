#include "rover/simulation/spline_basis.h"

namespace rover {
namespace {

using Matrix6 = Eigen::Matrix<double, kSplineOrder, kSplineOrder>;

// Row j holds the coefficients of u^0 .. u^5 of control point j (de Boor, "A practical guide to
// splines", for uniform knots).
Matrix6 blending_matrix() {
  Matrix6 matrix;
  matrix << 1, -5, 10, -10, 5, -1,  //
      26, -50, 20, 20, -20, 5,      //
      66, 0, -60, 0, 30, -10,       //
      26, 50, 20, -20, -20, 10,     //
      1, 5, 10, 10, 5, -5,          //
      0, 0, 0, 0, 0, 1;
  return matrix / 120;
}

SplineBasis::Weights cumulated(SplineBasis::Weights weights) {
  for (int j = kSplineOrder - 2; j >= 0; --j) weights[j] += weights[j + 1];
  return weights;
}

}  // namespace

SplineBasis SplineBasis::at(double u, double knot_interval) {
  static const Matrix6 kBlending = blending_matrix();
  const double u2 = u * u, u3 = u2 * u, rate = 1 / knot_interval;
  SplineBasis basis;
  basis.value = kBlending * Weights(1, u, u2, u3, u2 * u2, u2 * u3);
  basis.first = rate * (kBlending * Weights(0, 1, 2 * u, 3 * u2, 4 * u3, 5 * u2 * u2));
  basis.second = rate * rate * (kBlending * Weights(0, 0, 2, 6 * u, 12 * u2, 20 * u3));
  return basis;
}

SplineBasis SplineBasis::cumulative() const {
  return {cumulated(value), cumulated(first), cumulated(second)};
}

}  // namespace rover
