#include "rover/camera/calibration_file.h"

#include <cmath>

#include "rover/base/error.h"
#include "rover/camera/yaml_section.h"

namespace rover {
namespace {

void check_projection(const YamlSection& section) {
  const std::string name = section.text("camera_model");
  if (name != "pinhole")
    section.fail("camera_model", "'" + name +
                                     "' is not supported; calibrate with 'pinhole' and the "
                                     "distortion 'radtan' or 'equidistant' (fisheye)");
}

CameraModel read_model(const YamlSection& section) {
  check_projection(section);
  const std::string name = section.text("distortion_model");
  if (name == "radial-tangential" || name == "radtan" || name == "plumb_bob" || name == "none")
    return CameraModel::kPinhole;
  if (name == "equidistant" || name == "equi" || name == "kannala-brandt")
    return CameraModel::kFisheye;
  section.fail("distortion_model", "'" + name +
                                       "' is not known; expected radial-tangential (radtan), "
                                       "equidistant (fisheye) or none");
}

std::vector<double> read_distortion(const YamlSection& section) {
  if (section.text("distortion_model") == "none") return {};
  const bool kalibr = section.has("distortion_coeffs");
  const std::string key = kalibr ? "distortion_coeffs" : "distortion_coefficients";
  const std::vector<double> values = section.numbers(key);
  if (values.size() < 4)
    section.fail(key, fmt::format("must hold at least 4 numbers, not {}", values.size()));
  return values;
}

int read_pixels(const YamlSection& section, double value) {
  if (!(value >= 1 && value <= 1e5) || value != std::floor(value))
    section.fail("resolution", "must hold the image's width and height in whole pixels");
  return static_cast<int>(value);
}

Camera read_camera(const YamlSection& section) {
  const CameraModel model = read_model(section);
  const auto size = section.numbers("resolution", 2, "width and height in pixels");
  const auto k = section.numbers("intrinsics", 4, "fx fy cx cy");
  const int width = read_pixels(section, size[0]), height = read_pixels(section, size[1]);
  const std::vector<double> distortion = read_distortion(section);
  try {
    return Camera(model, width, height, {k[0], k[1], k[2], k[3]}, distortion);
  } catch (const InputError& error) {
    section.fail("intrinsics", error.what());
  }
}

RigCalibration read_euroc(const YamlSection& root) {
  RigCalibration calibration;
  calibration.rig = {{read_camera(root)}, {root.transform("T_BS")}};
  calibration.has_body = true;
  calibration.time_offset = {0};
  return calibration;
}

// Kalibr's T_cam_imu is camera_from_body, T_cn_cnm1 is camera_from_previous (Kalibr's wiki, "YAML
// formats").
SE3 kalibr_extrinsics(const YamlSection& camera, const RigCalibration& before) {
  if (before.has_body && camera.has("T_cam_imu")) return camera.transform("T_cam_imu").inverse();
  if (before.rig.size() == 0) return SE3();
  return before.rig.body_from_camera.back() * camera.transform("T_cn_cnm1").inverse();
}

RigCalibration read_kalibr(const YamlSection& root) {
  RigCalibration calibration;
  calibration.has_body = root.section("cam0").has("T_cam_imu");
  for (int i = 0; root.has(fmt::format("cam{}", i)); ++i) {
    const YamlSection camera = root.section(fmt::format("cam{}", i));
    calibration.rig.body_from_camera.push_back(kalibr_extrinsics(camera, calibration));
    calibration.rig.cameras.push_back(read_camera(camera));
    const bool shifted = camera.has("timeshift_cam_imu");
    calibration.time_offset.push_back(shifted ? camera.number("timeshift_cam_imu") : 0);
  }
  return calibration;
}

}  // namespace

RigCalibration read_calibration(const std::filesystem::path& file) {
  const YamlSection root = YamlSection::load(file);
  return root.has("cam0") ? read_kalibr(root) : read_euroc(root);
}

RigCalibration read_calibration(const std::vector<std::filesystem::path>& files) {
  require(!files.empty(), "no calibration file was given");
  RigCalibration all;
  all.has_body = true;
  for (const auto& file : files) {
    const RigCalibration one = read_euroc(YamlSection::load(file));
    all.rig.cameras.push_back(one.rig.cameras[0]);
    all.rig.body_from_camera.push_back(one.rig.body_from_camera[0]);
    all.time_offset.push_back(0);
  }
  return all;
}

}  // namespace rover
