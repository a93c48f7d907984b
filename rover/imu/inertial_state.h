#pragma once

#include <Eigen/Core>

#include "rover/geometry/se3.h"

namespace rover {

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;
using Vector15d = Eigen::Matrix<double, 15, 1>;
using Matrix15d = Eigen::Matrix<double, 15, 15>;
using Matrix15x3d = Eigen::Matrix<double, 15, 3>;

// What the sensor reads too much: measured = true + bias + noise, in the sensor's frame.
struct ImuBias {
  Eigen::Vector3d gyroscope = Eigen::Vector3d::Zero();      // rad/s
  Eigen::Vector3d accelerometer = Eigen::Vector3d::Zero();  // m/s^2

  Vector6d vector() const { return (Vector6d() << gyroscope, accelerometer).finished(); }
  static ImuBias from_vector(const Vector6d& v) { return {v.head<3>(), v.tail<3>()}; }
};

// The state of the body (whose frame is the inertial sensor's). The tangent, of 15 elements, is
// (translation, rotation) of se3_plus, velocity, gyroscope bias, accelerometer bias.
struct InertialState {
  SE3 world_from_body;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // of the body, in the world, m/s
  ImuBias bias;
};

inline InertialState state_plus(const InertialState& state, const Vector15d& delta) {
  return {se3_plus(state.world_from_body, delta.head<6>()), state.velocity + delta.segment<3>(6),
          ImuBias::from_vector(state.bias.vector() + delta.tail<6>())};
}

// The delta with state_plus(from, delta) == to.
inline Vector15d state_minus(const InertialState& to, const InertialState& from) {
  Vector15d delta;
  delta << se3_minus(to.world_from_body, from.world_from_body), to.velocity - from.velocity,
      to.bias.vector() - from.bias.vector();
  return delta;
}

// Gravity of a world whose z axis points up, m/s^2.
inline constexpr double kGravity = 9.81;
inline Eigen::Vector3d gravity_of_z_up() { return {0, 0, -kGravity}; }

}  // namespace rover
