#pragma once

#include <optional>
#include <span>

#include "rover/imu/imu_buffer.h"
#include "rover/imu/inertial_state.h"

namespace rover {

// The orientation of a camera at one stamp of its own clock.
struct StampedRotation {
  Timestamp time = 0;
  Eigen::Quaterniond world_from_camera;
};

struct CameraImuAlignmentOptions {
  double max_offset = 0.1;  // s: how far apart the clocks may be
  double interval = 0.2;    // s between the orientations that are compared, at least
  int iterations = 10;

  void check() const;
};

// How a camera turns, against how the gyroscope says that it turns.
struct CameraImuAlignment {
  Eigen::Quaterniond body_from_camera;
  double rotation_sigma = 0;  // rad, the worst axis, posterior standard deviation
  double time_offset = 0;     // s: time of the inertial clock = time of the camera's + offset
  double time_sigma = 0;      // s
  Eigen::Vector3d gyroscope_bias;
  double residual = 0;  // rad rms per axis and interval
};

// Estimates extrinsic rotation, time offset and gyroscope bias from rotations alone (hand-eye
// calibration): the offset from angles, which depend on no extrinsics, on a grid; the rotation by
// Wahba's problem (Kabsch 1976); then all by Gauss-Newton. Finds axes that are swapped, extrinsics
// that are wrong and clocks that are apart; more than a degree or 10 ms deserve a warning. Nothing
// where the motion does not suffice: it takes rotation about two axes. Orientations in order of
// time. Throws InputError for options that make no sense.
std::optional<CameraImuAlignment> align_camera_to_imu(std::span<const StampedRotation> rotations,
                                                      const ImuBuffer& imu,
                                                      const CameraImuAlignmentOptions& options);

}  // namespace rover
