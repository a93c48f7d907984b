#pragma once

#include "rover/optimization/imu_factor.h"

namespace rover {

// A map errs as a whole. Four ways nobody can notice (drift.h), and three that inertial data do:
// tilt (about the world's x and y axis, rad) and the logarithm of its scale. Images do not notice
// these either, so they are common to all that is estimated from the map as if it were exact, and
// no observation of its landmarks lessens them. Estimates therefore keep apart what they know given
// the map and how they err with it, as the Schmidt-Kalman filter does with parameters that it
// considers but does not estimate (Schmidt 1966; Jazwinski 1970, section 8.4).

// How a state that is fixed to the map moves with the error (by its tangent), which turns the map
// and makes it grow about `pivot`. `lever`: the camera in the body, which is metric whatever the
// map's scale.
Matrix15x3d by_map_error(const InertialState& state, const Eigen::Vector3d& lever,
                         const Eigen::Vector3d& pivot = Eigen::Vector3d::Zero());

// Of a state that the error turns and makes grow about its own position, which stays: what makes a
// response in the frame of the map one in the upright world.
inline Matrix15x3d upright(const InertialState& state) {
  return by_map_error(state, Eigen::Vector3d::Zero(), state.world_from_body.translation);
}

}  // namespace rover
