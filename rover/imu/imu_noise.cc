#include "rover/imu/imu_noise.h"

#include "rover/base/error.h"

namespace rover {

void ImuNoiseOptions::check() const {
  require(gyroscope_inflation > 0 && accelerometer_inflation > 0 && gyroscope_walk_inflation > 0 &&
              accelerometer_walk_inflation > 0,
          "imu noise: inflations must be positive, but are {}, {}, {} and {}", gyroscope_inflation,
          accelerometer_inflation, gyroscope_walk_inflation, accelerometer_walk_inflation);
  require(gap > 0, "imu noise: gap must be positive, not {} s", gap);
  require(gap_angular_velocity > 0 && gap_acceleration > 0,
          "imu noise: what is assumed in gaps must be positive, not {} rad/s and {} m/s^2",
          gap_angular_velocity, gap_acceleration);
}

ImuNoise ImuNoise::of(const ImuCalibration& calibration, const ImuNoiseOptions& options) {
  options.check();
  require(
      calibration.gyroscope_noise > 0 && calibration.accelerometer_noise > 0 &&
          calibration.gyroscope_walk > 0 && calibration.accelerometer_walk > 0,
      "imu noise: densities must be positive, but are {}, {}, {} and {}; see the sensor.yaml of "
      "the inertial sensor",
      calibration.gyroscope_noise, calibration.accelerometer_noise, calibration.gyroscope_walk,
      calibration.accelerometer_walk);
  ImuNoise noise;
  noise.gyroscope = options.gyroscope_inflation * calibration.gyroscope_noise;
  noise.accelerometer = options.accelerometer_inflation * calibration.accelerometer_noise;
  noise.gyroscope_walk = options.gyroscope_walk_inflation * calibration.gyroscope_walk;
  noise.accelerometer_walk = options.accelerometer_walk_inflation * calibration.accelerometer_walk;
  noise.gap = options.gap;
  noise.gap_angular_velocity = options.gap_angular_velocity;
  noise.gap_acceleration = options.gap_acceleration;
  return noise;
}

}  // namespace rover
