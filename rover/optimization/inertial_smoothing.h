#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "rover/optimization/imu_factor.h"

namespace rover {

// A state as it was known when it was the newest one, and the motion from it to the next.
struct ReckonedStep {
  InertialState state;
  Matrix15d information;  // of it (inverse covariance, tangent of InertialState)
  std::shared_ptr<const Preintegration> motion;
};

// Dead reckoning looked at from its end: the states of the steps once the state after the last of
// them is known. Each moves as far as its own uncertainty and that of the motions behind it allow
// (the backward pass of Rauch, Tung and Striebel 1965, with the inertial factor itself). A step
// that cannot be solved, and those before it, stay as they were.
std::vector<InertialState> smooth_reckoning(std::span<const ReckonedStep> steps,
                                            const InertialState& end,
                                            const Eigen::Vector3d& gravity = gravity_of_z_up());

// A state that is known, and the motion between it and its neighbour in time.
struct KnownNeighbour {
  const InertialState& state;
  const Preintegration& motion;
};

// A state between two that are known, from the motion on both sides of it and what else is known
// of it. Nothing if it cannot be solved.
std::optional<InertialState> state_between(const KnownNeighbour& before,
                                           const KnownNeighbour& after, const StatePrior& known,
                                           const Eigen::Vector3d& gravity = gravity_of_z_up());

}  // namespace rover
