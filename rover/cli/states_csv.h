#pragma once

#include <string>
#include <vector>

#include "rover/base/timestamp.h"
#include "rover/imu/inertial_state.h"

namespace rover {

// One line of states.csv: of each frame of a run, so nothing more is kept than what is written.
struct StateRecord {
  Timestamp time = 0;
  Eigen::Vector3d velocity;     // m/s, world
  ImuBias bias;                 // rad/s, m/s^2
  Vector9d sigma;               // of velocity and biases
  Eigen::Vector4d drift_sigma;  // m, rad: of position (world axes) and yaw
};

// `covariance`: of pose, velocity and biases given position and yaw of the map; `drift`: of the map
// there, see drift.h.
StateRecord state_record(Timestamp time, const InertialState& state, const Matrix15d& covariance,
                         const Eigen::Matrix4d& drift);

// time, velocity (m/s, world), biases of gyroscope (rad/s) and accelerometer (m/s^2), and the
// standard deviation of each; then the standard deviations of position (m, world axes) and yaw
// (rad) since the map began.
std::string states_csv(const std::vector<StateRecord>& states);

}  // namespace rover
