#include "rover/optimization/dense_equations.h"

#include <algorithm>

#include <Eigen/Cholesky>

namespace rover {

void DenseEquations::reset(int unknowns) {
  hessian.setZero(unknowns, unknowns);
  gradient.setZero(unknowns);
  cost = 0;
}

bool solve_damped(const DenseEquations& equations, const Damping& damping, DenseStep& step) {
  Eigen::MatrixXd damped = equations.hessian;
  Eigen::VectorXd added(damped.rows());
  for (Eigen::Index i = 0; i < damped.rows(); ++i) added[i] = damping.of(damped(i, i));
  damped.diagonal() += added;
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(damped);
  if (cholesky.info() != Eigen::Success) return false;
  step.delta = -equations.gradient;
  cholesky.solveInPlace(step.delta);
  if (!step.delta.allFinite()) return false;
  step.predicted_decrease =
      0.5 * step.delta.dot(added.cwiseProduct(step.delta) - equations.gradient);
  return true;
}

// With P = I - n n^T, P H P + pivot n n^T for one direction n after the other.
void hold_directions(const Eigen::MatrixXd& held, Eigen::MatrixXd& hessian,
                     Eigen::VectorXd& right_side) {
  for (Eigen::Index k = 0; k < held.cols(); ++k) {
    const Eigen::VectorXd n = held.col(k);
    const Eigen::VectorXd w = hessian.selfadjointView<Eigen::Lower>() * n;
    const double curvature = n.dot(w);
    const double pivot = std::max(hessian.trace() / static_cast<double>(hessian.rows()), 1e-6);
    hessian.selfadjointView<Eigen::Lower>().rankUpdate(n, w, -1.0);
    hessian.selfadjointView<Eigen::Lower>().rankUpdate(n, curvature + pivot);
    right_side -= n * n.dot(right_side);
  }
}

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& hessian) {
  if (hessian.rows() == 0 || !hessian.allFinite() || !(hessian.diagonal().minCoeff() > 0))
    return {};
  const Eigen::VectorXd scale = hessian.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * hessian * scale.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> factors(scaled);
  if (factors.info() != Eigen::Success || !(factors.vectorD().minCoeff() > 1e-14)) return {};
  const Eigen::MatrixXd inverse =
      factors.solve(Eigen::MatrixXd::Identity(hessian.rows(), hessian.cols()));
  return scale.asDiagonal() * (0.5 * (inverse + inverse.transpose())) * scale.asDiagonal();
}

// (H^-1)_bb = Y^T Y with H = L L^T and Y the columns of L^-1 that belong to the block.
std::optional<Matrix15d> inverse_block(const Eigen::MatrixXd& hessian, Eigen::Index row) {
  if (!hessian.allFinite() || !(hessian.diagonal().minCoeff() > 0)) return std::nullopt;
  const Eigen::VectorXd scale = hessian.diagonal().cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = scale.asDiagonal() * hessian * scale.asDiagonal();
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factors(scaled);
  if (factors.info() != Eigen::Success || !(scaled.diagonal().minCoeff() > 1e-7))
    return std::nullopt;
  Eigen::Matrix<double, Eigen::Dynamic, 15> columns =
      Eigen::Matrix<double, Eigen::Dynamic, 15>::Zero(hessian.rows(), 15);
  columns.middleRows<15>(row).setIdentity();
  factors.matrixL().solveInPlace(columns);
  const auto own = scale.segment<15>(row).asDiagonal();
  return Matrix15d(own * (columns.transpose() * columns) * own);
}

}  // namespace rover
