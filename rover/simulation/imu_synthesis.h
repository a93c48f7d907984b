#pragma once

#include <cstdint>
#include <vector>

#include "rover/imu/imu_sample.h"
#include "rover/imu/inertial_state.h"
#include "rover/simulation/motion.h"

namespace rover {

// Inertial data with the biases that are in them, one per sample.
struct ImuRecording {
  std::vector<ImuSample> samples;
  std::vector<ImuBias> biases;
};

// The noise that EuRoC states for its ADIS16448, at 200 Hz.
inline ImuCalibration euroc_imu_calibration() {
  return {1.6968e-4, 1.9393e-5, 2.0e-3, 3.0e-3, 200};
}

struct ImuSynthesisOptions {
  ImuCalibration calibration = euroc_imu_calibration();
  double gravity = kGravity;  // m/s^2
  // Deviation of the biases at the start, on each axis.
  double gyroscope_bias = 0.03;      // rad/s
  double accelerometer_bias = 0.05;  // m/s^2
  bool noise = true;                 // false: exact readings, no biases
  std::uint64_t seed = 0;

  // Throws InputError for values that make no sense.
  void check() const;
};

// What an inertial sensor in the body's origin reads at each of its samples: angular velocity and
// specific force R^T (a - g) from the motion's own derivatives, plus bias and white noise. Biases
// are random walks. Samples reach from begin() to end(); seconds 0 of the motion is at `epoch`.
ImuRecording synthesize_imu(const Motion& motion, Timestamp epoch,
                            const ImuSynthesisOptions& options = {});

}  // namespace rover
