#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "rover/simulation/spline_basis.h"

namespace rover {

// Three residuals that depend on six neighbouring control points, six unknowns each (position,
// orientation), and on a few of the unknowns that all share.
struct SplineResidual {
  static constexpr int kBand = 6 * kSplineOrder;
  static constexpr int kMaxShared = 8;

  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  int first = 0;  // control point
  Eigen::Matrix<double, 3, kBand> by_control = Eigen::Matrix<double, 3, kBand>::Zero();
  std::vector<int> shared;  // which ones, at most kMaxShared
  Eigen::Matrix<double, 3, kMaxShared> by_shared = Eigen::Matrix<double, 3, kMaxShared>::Zero();
};

// Gauss-Newton's normal equations of a spline: a band for the control points, bordered by the
// shared unknowns.
class SplineEquations {
 public:
  SplineEquations(int control_points, int shared);

  void add(const SplineResidual& residual, double weight);
  // A residual of shared unknowns only.
  void add_shared(const Eigen::VectorXd& jacobian, double value, double weight);
  // The step (control points, then shared unknowns) that solves them; nothing if they do not
  // determine it. Unknowns that hardly count are held by a small damping.
  std::optional<Eigen::VectorXd> solve() const;

 private:
  int shared_begin() const { return 6 * static_cast<int>(band_.size()); }

  std::vector<Eigen::Matrix<double, 6, SplineResidual::kBand>> band_;  // upper, from the diagonal
  Eigen::MatrixXd border_, corner_;
  Eigen::VectorXd gradient_;
};

}  // namespace rover
