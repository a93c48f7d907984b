#pragma once

#include <Eigen/Core>

#include "rover/geometry/se3.h"

namespace rover {

// The state of the body at one time, from a motion that is smooth enough to have them all.
struct MotionState {
  SE3 world_from_body;                                         // z up
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          // of the body, in the world, m/s
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();      // likewise, without gravity, m/s^2
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  // in the body frame, rad/s
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();  // in the body frame, rad/s^2
};

// How a rigid body moves. Times are seconds since the motion's own start; safe to use from several
// threads.
class Motion {
 public:
  virtual ~Motion() = default;
  virtual double begin() const = 0;
  virtual double end() const = 0;
  // begin() <= seconds <= end().
  virtual MotionState at(double seconds) const = 0;
};

}  // namespace rover
