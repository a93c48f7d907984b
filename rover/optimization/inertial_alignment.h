#pragma once

#include <optional>
#include <vector>

#include "rover/optimization/inertial_initialization.h"

namespace rover {

// The unknowns of inertial initialisation.
struct AlignmentState {
  Eigen::Quaterniond world_from_aligned = Eigen::Quaterniond::Identity();
  double log_scale = 0;
  ImuBias bias;
  std::vector<Eigen::Vector3d> velocity;  // per keyframe, metric, along the axes of `world`

  Eigen::Vector3d gravity() const { return world_from_aligned * gravity_of_z_up(); }
};

// The start: the gyroscope's bias from rotations alone, then velocities, gravity and scale from
// linear least squares, without the accelerometer's bias. The problem's motions are integrated anew
// with the bias found. Nothing where the system is singular or the scale comes out negative.
std::optional<AlignmentState> linear_alignment(InitializationProblem& problem);

// State of one keyframe for the given unknowns, along the axes of `world`.
InertialState scaled_state(const InitializationProblem& problem, const AlignmentState& state,
                           std::size_t keyframe);

// The rotation that turns the z axis against gravity with the smallest angle.
Eigen::Quaterniond world_from_aligned(const Eigen::Vector3d& gravity_in_world);

}  // namespace rover
