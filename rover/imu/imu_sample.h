#pragma once

#include <Eigen/Core>

#include "rover/base/timestamp.h"

namespace rover {

// One reading of the inertial sensor, in its own frame.
struct ImuSample {
  Timestamp time = 0;
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  // rad/s
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();      // m/s^2, specific force
};

// Noise of the inertial sensor, continuous time.
struct ImuCalibration {
  double gyroscope_noise = 0;      // rad/s/sqrt(Hz)
  double gyroscope_walk = 0;       // rad/s^2/sqrt(Hz)
  double accelerometer_noise = 0;  // m/s^2/sqrt(Hz)
  double accelerometer_walk = 0;   // m/s^3/sqrt(Hz)
  double rate = 0;                 // Hz
};

}  // namespace rover
