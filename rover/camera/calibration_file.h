#pragma once

#include <filesystem>
#include <vector>

#include "rover/camera/camera.h"

namespace rover {

// A camera rig as its calibration files describe it.
struct RigCalibration {
  Rig rig;
  // Whether the body frame is the IMU's (or another frame that the file names); otherwise the file
  // says nothing about a body and the body frame is camera 0.
  bool has_body = false;
  // For each camera, seconds to add to its image stamps to get the IMU's time (Kalibr's
  // timeshift_cam_imu; 0 where the file has none).
  std::vector<double> time_offset;
};

// Reads one file: an EuRoC `sensor.yaml` of one camera (T_BS is body_from_camera), or a Kalibr
// camchain with cameras cam0, cam1, ... (T_cam_imu is camera_from_body; a camera without it is
// chained to the one before by T_cn_cnm1). The header `%YAML:1.0` of OpenCV is accepted.
//
// Throws InputError that names the file, the line where known, the key and what is wrong with it:
// unreadable file, bad YAML, missing or ill-typed key, wrong count, numbers that are not finite, a
// transform that is not rigid, an unknown model, a camera that makes no sense.
RigCalibration read_calibration(const std::filesystem::path& file);

// The same for a rig with one EuRoC file per camera, in the order given.
RigCalibration read_calibration(const std::vector<std::filesystem::path>& files);

}  // namespace rover
