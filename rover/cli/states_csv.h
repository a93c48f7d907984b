#pragma once

#include <string>
#include <vector>

#include "rover/base/timestamp.h"
#include "rover/imu/inertial_state.h"

namespace rover {

// One line of states.csv.
struct StateRecord {
  Timestamp time = 0;
  InertialState state;
  Matrix15d covariance;   // given position and yaw of the map
  Eigen::Matrix4d drift;  // of the map there: see drift.h
};

// time, velocity (m/s, world), biases of gyroscope (rad/s) and accelerometer (m/s^2), and the
// standard deviation of each; then the standard deviations of position (m, world axes) and yaw
// (rad) since the map began.
std::string states_csv(const std::vector<StateRecord>& states);

}  // namespace rover
