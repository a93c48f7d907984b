#pragma once

#include "rover/base/random.h"
#include "rover/geometry/se3.h"

namespace rover {

// Seeded random geometry for simulations and property tests.

inline Eigen::Vector3d random_gaussian_vector(Random& random) {
  const double x = random.gaussian(), y = random.gaussian(), z = random.gaussian();
  return {x, y, z};
}

// Uniform on the unit sphere.
inline Eigen::Vector3d random_direction(Random& random) {
  while (true) {
    const Eigen::Vector3d v = random_gaussian_vector(random);
    if (v.norm() > 1e-6) return v.normalized();
  }
}

// An axis that is uniform on the sphere, an angle that is uniform in [0, max_angle] rad.
inline Eigen::Quaterniond random_rotation(Random& random, double max_angle = std::numbers::pi) {
  const Eigen::Vector3d axis = random_direction(random);
  return so3_exp(random.uniform(0, max_angle) * axis);
}

// A random rotation as above; the translation is normal with the given deviation per axis.
inline SE3 random_pose(Random& random, double deviation = 1, double max_angle = std::numbers::pi) {
  const Eigen::Quaterniond rotation = random_rotation(random, max_angle);
  return {rotation, deviation * random_gaussian_vector(random)};
}

// A unit bearing turned by a small random angle: normal with deviation `sigma` rad on each of the
// two axes across it.
inline Eigen::Vector3d disturb_bearing(const Eigen::Vector3d& bearing, double sigma,
                                       Random& random) {
  const Eigen::Vector3d noise = sigma * random_gaussian_vector(random);
  return (bearing + noise - bearing * bearing.dot(noise)).normalized();
}

}  // namespace rover
