#pragma once

#include <span>

#include "rover/datasets/trajectory.h"
#include "rover/diagnosis/finding.h"
#include "rover/imu/imu_sample.h"

namespace rover {

// Inertial data by themselves: times, units, what they say at rest, against the calibration.
void check_inertial_data(std::span<const ImuSample> samples, const ImuCalibration& calibration,
                         Findings& findings);

// Inertial data against the motion that the camera saw (world_from_camera, any scale): units and
// axes of both sensors, the clocks' offset, the extrinsic rotation, the gyroscope's bias.
void check_camera_against_imu(const Trajectory& camera, const Eigen::Quaterniond& body_from_camera,
                              std::span<const ImuSample> samples, Findings& findings);

}  // namespace rover
