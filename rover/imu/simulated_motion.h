#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "rover/geometry/random_geometry.h"
#include "rover/imu/imu_noise.h"
#include "rover/imu/inertial_state.h"

namespace rover {

// A motion made of a few sines, with its exact derivatives: known answers for tests.
struct SimulatedMotion {
  struct Wave {
    double amplitude = 0, frequency = 0, phase = 0;  // m or rad, rad/s, rad
    double value(double t) const { return amplitude * std::sin(frequency * t + phase); }
    double rate(double t) const { return amplitude * frequency * std::cos(frequency * t + phase); }
    double rate2(double t) const { return -frequency * frequency * value(t); }
  };
  std::array<Wave, 3> position;
  std::array<Wave, 3> angles;  // roll, pitch, yaw

  // Lively hand-held motion.
  static SimulatedMotion random(Random& random) {
    SimulatedMotion motion;
    for (Wave& wave : motion.position)
      wave = {random.uniform(0.4, 0.9), random.uniform(1, 2.2), random.uniform(0, 6.28)};
    for (Wave& wave : motion.angles)
      wave = {random.uniform(0.1, 0.3), random.uniform(1, 2.5), random.uniform(0, 6.28)};
    return motion;
  }

  SE3 pose(double t) const {
    const Eigen::Quaterniond rotation = so3_exp({0, 0, angles[2].value(t)}) *
                                        so3_exp({0, angles[1].value(t), 0}) *
                                        so3_exp({angles[0].value(t), 0, 0});
    return {rotation, {position[0].value(t), position[1].value(t), position[2].value(t)}};
  }
  InertialState state(double t, const ImuBias& bias = {}) const {
    return {pose(t), {position[0].rate(t), position[1].rate(t), position[2].rate(t)}, bias};
  }
  // From the rates of roll, pitch and yaw.
  Eigen::Vector3d angular_velocity(double t) const {
    const double roll = angles[0].value(t), pitch = angles[1].value(t);
    const double p = angles[0].rate(t), q = angles[1].rate(t), r = angles[2].rate(t);
    return {p - r * std::sin(pitch), q * std::cos(roll) + r * std::sin(roll) * std::cos(pitch),
            -q * std::sin(roll) + r * std::cos(roll) * std::cos(pitch)};
  }
  Eigen::Vector3d specific_force(double t) const {
    const Eigen::Vector3d acceleration(position[0].rate2(t), position[1].rate2(t),
                                       position[2].rate2(t));
    return pose(t).rotation.conjugate() * (acceleration - gravity_of_z_up());
  }
  ImuSample sample(double t, const ImuBias& bias = {}) const {
    return {from_seconds(t), angular_velocity(t) + bias.gyroscope,
            specific_force(t) + bias.accelerometer};
  }
};

// Samples from begin to end, `rate` per second, with white noise of the given densities.
inline std::vector<ImuSample> simulate_imu(const SimulatedMotion& motion, double begin, double end,
                                           double rate, const ImuBias& bias, const ImuNoise& noise,
                                           Random& random) {
  std::vector<ImuSample> samples;
  const int count = static_cast<int>(std::lround((end - begin) * rate));
  for (int i = 0; i <= count; ++i) {
    ImuSample sample = motion.sample(begin + i / rate, bias);
    sample.angular_velocity += noise.gyroscope * std::sqrt(rate) * random_gaussian_vector(random);
    sample.acceleration += noise.accelerometer * std::sqrt(rate) * random_gaussian_vector(random);
    samples.push_back(sample);
  }
  return samples;
}

// Densities of EuRoC's sensor, not inflated unless asked for.
inline ImuNoise simulated_noise(double inflation = 1) {
  ImuNoiseOptions options;
  options.gyroscope_inflation = options.accelerometer_inflation = inflation;
  options.gyroscope_walk_inflation = options.accelerometer_walk_inflation = 1;
  return ImuNoise::of({1.7e-4, 1.9e-5, 2e-3, 3e-3, 200}, options);
}

}  // namespace rover
