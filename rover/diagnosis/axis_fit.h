#pragma once

#include <optional>
#include <string>

#include "rover/datasets/trajectory.h"
#include "rover/imu/imu_buffer.h"

namespace rover {

// Fits of the readings to what a camera saw under each of the 48 ways in which three axes can be
// mixed up or turned round. `axes` is the right one: true = axes * reading, the identity where the
// sensor is in order. Mirrored ones, which no rotation can mend, are among them.

// "(y, -x, z)": which readings belong into x, y and z.
std::string describe_axes(const Eigen::Matrix3d& axes);

// Angular velocities, means over some 0.2 s. Correlations are of vectors, -1 to 1.
struct GyroscopeFit {
  Eigen::Matrix3d axes;
  double correlation = 0;      // with these axes
  double as_given = 0;         // with the axes as they are
  double any_orientation = 0;  // whatever the axes and the extrinsics: low where the readings are
                               // not of this camera's motion
  double scale = 0;            // factor from readings to what the camera saw: 1 in the right unit
  double time_offset = 0;  // s, to 5 ms: time of the inertial clock = time of the camera's + offset
  double motion = 0;       // rad/s, rms of what the camera saw, without its mean
};

// body_from_world orientations are made of `camera` (world_from_camera) and `body_from_camera`.
// Nothing for less than 10 stretches of 0.2 s that inertial data cover.
std::optional<GyroscopeFit> fit_gyroscope(const Trajectory& camera,
                                          const Eigen::Quaterniond& body_from_camera,
                                          const ImuBuffer& imu, double max_offset);

// Accelerations: a visual one of unknown scale and gravity, constant in the camera's world.
struct AccelerometerFit {
  Eigen::Matrix3d axes;
  double residual = 0;  // rms of one axis, m/s^2 if gravity is 9.81 in the readings
  double as_given = 0;  // the same with the axes as they are
  double gravity = 0;   // unit of the readings
};

// `camera` may be of any scale; clocks must be together.
std::optional<AccelerometerFit> fit_accelerometer(const Trajectory& camera,
                                                  const Eigen::Quaterniond& body_from_camera,
                                                  const ImuBuffer& imu);

}  // namespace rover
