#include "rover/simulation/spline_equations.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

namespace rover {
namespace {

constexpr double kDamping = 1e-9;  // relative to the diagonal

using Triplets = std::vector<Eigen::Triplet<double>>;

// The lower triangle's entries of the transposed block.
void append(const Eigen::MatrixXd& block, int row, int column, Triplets& triplets) {
  for (int i = 0; i < block.rows(); ++i) {
    for (int j = 0; j < block.cols(); ++j) {
      const bool lower = column + j >= row + i;
      if (lower && block(i, j) != 0) triplets.emplace_back(column + j, row + i, block(i, j));
    }
  }
}

}  // namespace

SplineEquations::SplineEquations(int control_points, int shared)
    : band_(control_points, Eigen::Matrix<double, 6, SplineResidual::kBand>::Zero()),
      border_(Eigen::MatrixXd::Zero(6 * control_points, shared)),
      corner_(Eigen::MatrixXd::Zero(shared, shared)),
      gradient_(Eigen::VectorXd::Zero(6 * control_points + shared)) {}

void SplineEquations::add(const SplineResidual& residual, double weight) {
  constexpr int kBand = SplineResidual::kBand;
  const auto& by_control = residual.by_control;
  for (int a = 0; a < kSplineOrder; ++a) {
    const int width = kBand - 6 * a;
    band_[residual.first + a].leftCols(width) +=
        weight * by_control.middleCols<6>(6 * a).transpose() * by_control.rightCols(width);
  }
  gradient_.segment<kBand>(6 * residual.first) += weight * by_control.transpose() * residual.value;
  for (std::size_t k = 0; k < residual.shared.size(); ++k) {
    const Eigen::Vector3d weighted = weight * residual.by_shared.col(k);
    const int unknown = residual.shared[k];
    border_.col(unknown).segment<kBand>(6 * residual.first) += by_control.transpose() * weighted;
    gradient_[shared_begin() + unknown] += weighted.dot(residual.value);
    for (std::size_t l = 0; l < residual.shared.size(); ++l) {
      corner_(unknown, residual.shared[l]) += weighted.dot(residual.by_shared.col(l));
    }
  }
}

void SplineEquations::add_shared(const Eigen::VectorXd& jacobian, double value, double weight) {
  corner_ += weight * jacobian * jacobian.transpose();
  gradient_.tail(corner_.rows()) += weight * value * jacobian;
}

std::optional<Eigen::VectorXd> SplineEquations::solve() const {
  Triplets triplets;
  const int count = static_cast<int>(band_.size());
  for (int i = 0; i < count; ++i) {
    const int width = 6 * std::min(kSplineOrder, count - i);
    append(band_[i].leftCols(width), 6 * i, 6 * i, triplets);
  }
  append(border_, 0, shared_begin(), triplets);
  append(corner_, shared_begin(), shared_begin(), triplets);
  Eigen::SparseMatrix<double> matrix(gradient_.size(), gradient_.size());
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  matrix.diagonal() *= 1 + kDamping;
  // The natural order keeps band and border as they are, without fill.
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>>
      cholesky(matrix);
  if (cholesky.info() != Eigen::Success) return {};
  return -cholesky.solve(gradient_);
}

}  // namespace rover
