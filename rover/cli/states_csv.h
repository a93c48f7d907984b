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
  Matrix15d covariance;
};

// time, velocity (m/s, world), biases of gyroscope (rad/s) and accelerometer (m/s^2), and the
// standard deviation of each.
std::string states_csv(const std::vector<StateRecord>& states);

}  // namespace rover
