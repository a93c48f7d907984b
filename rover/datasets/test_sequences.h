#pragma once

#include <string>
#include <vector>

#include <fmt/format.h>

#include "rover/base/timestamp.h"
#include "rover/datasets/test_folder.h"

// Small datasets in each format, written into a temporary folder.
namespace rover {

inline constexpr const char* kImuYaml =
    "gyroscope_noise_density: 1.7e-4\n"
    "gyroscope_random_walk: 1.9e-5\n"
    "accelerometer_noise_density: 2.0e-3\n"
    "accelerometer_random_walk: 3.0e-3\n"
    "update_rate: 200\n";

// Two fisheye cameras 0.1 m apart, the first 0.01 m from the inertial sensor.
inline constexpr const char* kCamchain =
    "cam0:\n"
    "  camera_model: pinhole\n"
    "  intrinsics: [30, 30, 32, 24]\n"
    "  distortion_model: equidistant\n"
    "  distortion_coeffs: [0.003, 0.0007, -0.002, 0.0002]\n"
    "  resolution: [64, 48]\n"
    "  T_cam_imu: [[1, 0, 0, 0.01], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
    "cam1:\n"
    "  camera_model: pinhole\n"
    "  intrinsics: [30, 30, 32, 24]\n"
    "  distortion_model: equidistant\n"
    "  distortion_coeffs: [0.003, 0.0007, -0.002, 0.0002]\n"
    "  resolution: [64, 48]\n"
    "  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n";

inline std::string camera_yaml(int width, int height, double x = 0) {
  return fmt::format(
      "%YAML:1.0\nsensor_type: camera\n"
      "T_BS:\n  cols: 4\n  rows: 4\n"
      "  data: [1.0, 0.0, 0.0, {},\n 0.0, 1.0, 0.0, 0.0,\n 0.0, 0.0, 1.0, 0.0,\n"
      "         0.0, 0.0, 0.0, 1.0]\n"
      "rate_hz: 20\nresolution: [{}, {}]\ncamera_model: pinhole\n"
      "intrinsics: [60.0, 60.0, 32.0, 24.0] #fu, fv, cu, cv\n"
      "distortion_model: radial-tangential\n"
      "distortion_coefficients: [-0.28, 0.07, 0.0002, 1.8e-05]\n",
      x, width, height);
}

inline Timestamp euroc_time(int index) {
  return 1403715285262142976 + static_cast<Timestamp>(index) * 50'000'000;
}

inline std::string euroc_image_list(const std::vector<int>& indices) {
  std::string text = "#timestamp [ns],filename\n";
  for (int i : indices) text += fmt::format("{0},{0}.png\n", euroc_time(i));
  return text;
}

inline std::string euroc_imu_list() {
  std::string text = "#timestamp [ns],w_RS_S_x [rad s^-1] ...\n";
  for (int i = -20; i <= 60; ++i) {
    text += fmt::format("{},0.1,0.2,0.3,0,0,9.81\n",
                        euroc_time(0) + static_cast<Timestamp>(i) * 5'000'000);
  }
  return text;
}

// Five stereo pairs at 20 Hz, inertial data from 0.1 s before to 0.1 s after them, ground truth.
inline void write_euroc(const TestFolder& folder) {
  for (const std::string camera : {"mav0/cam0/", "mav0/cam1/"}) {
    folder.write(camera + "data.csv", euroc_image_list({0, 1, 2, 3, 4}));
    folder.write(camera + "sensor.yaml", camera_yaml(64, 48, camera == "mav0/cam1/" ? 0.1 : 0));
    for (int i = 0; i < 5; ++i) {
      folder.write_image(fmt::format("{}data/{}.png", camera, euroc_time(i)), 64, 48, 50 + i);
    }
  }
  folder.write("mav0/imu0/sensor.yaml", std::string("%YAML:1.0\n") + kImuYaml);
  folder.write("mav0/imu0/data.csv", euroc_imu_list());
  std::string truth = "#timestamp, p_RS_R_x [m] ...\n";
  for (int i = 0; i < 5; ++i) truth += fmt::format("{},{},0,0,1,0,0,0,0,0,0\n", euroc_time(i), i);
  folder.write("mav0/state_groundtruth_estimate0/data.csv", truth);
}

inline void write_tum(const TestFolder& folder, const std::string& name) {
  std::string list = "# color images\n# timestamp filename\n";
  for (const char* stamp : {"1305031102.175304", "1305031102.211214", "1305031102.243211"}) {
    list += fmt::format("{0} rgb/{0}.png\n", stamp);
    folder.write_image(fmt::format("{}/rgb/{}.png", name, stamp), 640, 480);
  }
  folder.write(name + "/rgb.txt", list);
  folder.write(name + "/groundtruth.txt",
               "# timestamp tx ty tz qx qy qz qw\n"
               "1305031102.1750 1.3563 0.6305 1.6380 0.6132 0.5962 -0.3311 -0.3986\n"
               "1305031102.1850 1.3543 0.6306 1.6360 0.6129 0.5966 -0.3316 -0.3980\n");
}

inline void write_kitti(const TestFolder& folder, const std::string& prefix = "") {
  for (const char* camera : {"image_0", "image_1"}) {
    for (int i = 0; i < 3; ++i) {
      folder.write_image(fmt::format("{}{}/{:06}.png", prefix, camera, i), 124, 38);
    }
  }
  folder.write(prefix + "calib.txt",
               "P0: 7.18856e+02 0 6.07e+01 0 0 7.18856e+02 1.85e+01 0 0 0 1 0\n"
               "P1: 7.18856e+02 0 6.07e+01 -3.861448e+02 0 7.18856e+02 1.85e+01 0 0 0 1 0\n");
  folder.write(prefix + "times.txt", "0.000000e+00\n1.037359e-01\n2.073381e-01\n");
  folder.write(prefix + "poses.txt",
               "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 1\n1 0 0 0 0 1 0 0 0 0 1 2\n");
}

}  // namespace rover
