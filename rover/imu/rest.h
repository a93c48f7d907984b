#pragma once

#include <span>

#include "rover/imu/imu_sample.h"
#include "rover/imu/inertial_state.h"

namespace rover {

// What inertial data may show of a body at rest: more than the noise of sensors in use (rms 0.0024
// rad/s and 0.03 m/s^2 for EuRoC's on a table), far less than vibration in the air (1 m/s^2).
struct RestOptions {
  double gyroscope = 0.02;      // rad/s, rms of the readings less the bias
  double accelerometer = 0.15;  // m/s^2, rms scatter about their mean
  double gravity = 0.3;         // m/s^2 that the mean's length, less the bias, is off 9.81

  void check() const;
};

// Whether samples are those of a body at rest, or in steady straight motion, which they cannot tell
// apart. False without samples.
bool is_quiet(std::span<const ImuSample> samples, const ImuBias& bias, const RestOptions& options);

}  // namespace rover
