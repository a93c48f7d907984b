#pragma once

#include <array>

#include "rover/simulation/spline_motion.h"

namespace rover {

// How orientation and angular velocity of a spline depend on the orientations of the six control
// points that shape them, all with right perturbation R exp(d), d in rad.
struct SplineJacobians {
  std::array<Eigen::Matrix3d, kSplineOrder> orientation;
  std::array<Eigen::Matrix3d, kSplineOrder> angular_velocity;  // of the body frame's, 1/s

  // The first control point is that of motion.place_of(seconds).
  static SplineJacobians at(const SplineMotion& motion, double seconds);
};

}  // namespace rover
