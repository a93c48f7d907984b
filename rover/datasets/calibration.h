#pragma once

#include <filesystem>

#include "rover/camera/camera.h"
#include "rover/datasets/dataset.h"

namespace rover {

// Cameras as a calibration file describes them.
struct RigCalibration {
  Rig rig;                   // all cameras of the file
  bool body_is_imu = false;  // whether the file places them in the inertial sensor's frame; if not,
                             // the body frame is camera 0's
};

// Reads an EuRoC sensor.yaml (one camera; T_BS is body_from_camera) or a Kalibr camchain (cam0,
// cam1
// ...; T_cam_imu, T_cn_cnm1). Throws InputError naming the file and what is wrong in it.
RigCalibration read_rig_calibration(const std::filesystem::path& file);

struct ImuFileCalibration {
  ImuCalibration imu;
  SE3 body_from_imu;  // identity where the file does not say
};

// Reads an EuRoC imu0/sensor.yaml or a Kalibr imu.yaml. Throws InputError likewise.
ImuFileCalibration read_imu_calibration(const std::filesystem::path& file);

}  // namespace rover
