#pragma once

#include "rover/imu/preintegration.h"
#include "rover/optimization/dense_equations.h"

namespace rover {

struct ImuJacobians {
  Matrix15d by_from;  // tangents of InertialState
  Matrix15d by_to;
  Matrix15x3d by_gravity;
};

// How far two states are from what the inertial data between them say, whitened: the first 9
// elements are (position, rotation, velocity) of preintegration (Forster et al. 2017, equation 45),
// the last 6 the change of the bias (random walk), less what the first 9 tell of it. Gravity in the
// world of the states, m/s^2.
Vector15d imu_residual(const Preintegration& motion, const InertialState& from,
                       const InertialState& to, const Eigen::Vector3d& gravity,
                       ImuJacobians* jacobians = nullptr);

// Adds it to normal equations in which the states begin at the given rows (below zero: fixed).
// Returns the chi-square of its first 9 elements.
double add_imu_factor(const Preintegration& motion, const InertialState& from,
                      const InertialState& to, const Eigen::Vector3d& gravity, int from_row,
                      int to_row, DenseEquations& equations);

// What is known about a state beforehand: normal, with this information matrix (zero where nothing
// is known) in the tangent of `mean`.
struct StatePrior {
  InertialState mean;
  Matrix15d information = Matrix15d::Zero();
};

// state_minus(state, mean) and its Jacobian by the state.
Vector15d prior_difference(const StatePrior& prior, const InertialState& state,
                           Matrix15d* by_state = nullptr);

// Adds 0.5 d^T information d with d = state_minus(state, mean). Returns twice that.
double add_prior(const StatePrior& prior, const InertialState& state, int row,
                 DenseEquations& equations);

// Priors on parts of a state; standard deviations per axis.
StatePrior pose_prior(const SE3& world_from_body, double translation_sigma, double rotation_sigma);
StatePrior velocity_prior(const Eigen::Vector3d& velocity, double sigma);
StatePrior bias_prior(const ImuBias& bias, double gyroscope_sigma, double accelerometer_sigma);

// Standing still or hovering, up to `sigma` m/s (the zero-velocity update of inertial navigation).
inline StatePrior zero_velocity_prior(double sigma) {
  return velocity_prior(Eigen::Vector3d::Zero(), sigma);
}

}  // namespace rover
