#pragma once

#include <optional>

#include <Eigen/Core>

#include "rover/imu/inertial_state.h"
#include "rover/optimization/damping.h"

namespace rover {

// Normal equations H d = -g of a problem that is small enough for dense matrices.
struct DenseEquations {
  Eigen::MatrixXd hessian;  // only its lower half is read
  Eigen::VectorXd gradient;
  double cost = 0;       // 0.5 sum of squares
  Eigen::MatrixXd held;  // orthonormal columns: directions that do not move (gauge); or none

  void reset(int unknowns);

  // Adds a whitened residual that depends on one block of unknowns, or on two; a row below zero
  // stands for unknowns that are fixed.
  template <class Residual, class Jacobian>
  void add(const Residual& residual, const Jacobian& jacobian, int row) {
    add_gradient(residual, jacobian, row);
    add_block(jacobian, row, jacobian, row);
    cost += 0.5 * residual.squaredNorm();
  }
  template <class Residual, class First, class Second>
  void add(const Residual& residual, const First& first, int first_row, const Second& second,
           int second_row) {
    add(residual, first, first_row);
    add_gradient(residual, second, second_row);
    add_block(second, second_row, second, second_row);
    if (first_row < second_row) {
      add_block(second, second_row, first, first_row);
    } else {
      add_block(first, first_row, second, second_row);
    }
  }

 private:
  template <class Residual, class Jacobian>
  void add_gradient(const Residual& residual, const Jacobian& jacobian, int row) {
    if (row >= 0)
      gradient.segment<Jacobian::ColsAtCompileTime>(row).noalias() +=
          jacobian.transpose() * residual;
  }
  template <class Lower, class Upper>
  void add_block(const Lower& lower, int row, const Upper& upper, int column) {
    if (row >= 0 && column >= 0)
      hessian.block<Lower::ColsAtCompileTime, Upper::ColsAtCompileTime>(row, column).noalias() +=
          lower.transpose() * upper;
  }
};

struct DenseStep {
  Eigen::VectorXd delta;
  double predicted_decrease = 0;
};

// (H + D) d = -g with the damping D. False where that is not positive definite.
bool solve_damped(const DenseEquations& equations, const Damping& damping, DenseStep& step);

// Takes the held directions out of a system (lower half) and its right side: its solution has no
// part along them.
void hold_directions(const Eigen::MatrixXd& held, Eigen::MatrixXd& hessian,
                     Eigen::VectorXd& right_side);

// The inverse of a positive definite matrix (lower half), scaled to a unit diagonal meanwhile,
// where metres, radians and biases compare. An empty matrix where it is singular to rounding.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& hessian);

// The diagonal block of that inverse from `row` on: a factorisation and no more. Nothing where the
// matrix is singular to rounding.
std::optional<Matrix15d> inverse_block(const Eigen::MatrixXd& hessian, Eigen::Index row);

}  // namespace rover
