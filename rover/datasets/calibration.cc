#include "rover/datasets/calibration.h"

#include <set>

#include "rover/base/error.h"
#include "rover/datasets/yaml_file.h"

namespace rover {
namespace {

const std::set<std::string> kRadialTangential = {"radial-tangential", "radtan", "plumb_bob"};
const std::set<std::string> kFisheye = {"equidistant", "equi", "fisheye", "kannala-brandt"};

// A missing distortion is an error, not none: a file that was cut off must not pass.
CameraModel model_of(const YamlFields& fields) {
  const std::string model = fields.text("camera_model");
  const std::string distortion = fields.text("distortion_model");
  if (model == "pinhole" && kFisheye.contains(distortion)) return CameraModel::kFisheye;
  if (model == "pinhole" && (distortion == "none" || kRadialTangential.contains(distortion))) {
    return CameraModel::kPinhole;
  }
  fields.fail("camera model '" + model + "' with distortion '" + distortion +
              "' is not known; known is pinhole with radtan, equidistant or none");
}

std::vector<double> distortion_of(const YamlFields& fields) {
  if (fields.text("distortion_model") == "none") return {};
  const bool kalibr = fields.has("distortion_coeffs");
  return fields.numbers(kalibr ? "distortion_coeffs" : "distortion_coefficients");
}

int pixel_count(const YamlFields& fields, double value) {
  if (!(value >= 1 && value <= 65535 && value == static_cast<int>(value))) {
    fields.fail("'resolution' is not two whole numbers of pixels");
  }
  return static_cast<int>(value);
}

Camera camera_of(const YamlFields& fields) {
  const auto resolution = fields.numbers("resolution");
  const auto intrinsics = fields.numbers("intrinsics");
  if (resolution.size() != 2) fields.fail("'resolution' is not [width, height]");
  if (intrinsics.size() != 4) fields.fail("'intrinsics' is not [fx, fy, cx, cy]");
  const CameraModel model = model_of(fields);
  try {
    return {model,
            pixel_count(fields, resolution[0]),
            pixel_count(fields, resolution[1]),
            {intrinsics[0], intrinsics[1], intrinsics[2], intrinsics[3]},
            distortion_of(fields)};
  } catch (const InputError& error) {
    fields.fail(error.what());
  }
}

RigCalibration read_sensor(const YamlFields& fields) {
  RigCalibration result;
  result.rig.cameras.push_back(camera_of(fields));
  result.body_is_imu = fields.has("T_BS");
  result.rig.body_from_camera.push_back(result.body_is_imu ? fields.transform("T_BS") : SE3());
  return result;
}

SE3 body_from_chained_camera(const YamlFields& camera, const RigCalibration& so_far) {
  if (so_far.body_is_imu && camera.has("T_cam_imu")) return camera.transform("T_cam_imu").inverse();
  return so_far.rig.body_from_camera.back() * camera.transform("T_cn_cnm1").inverse();
}

RigCalibration read_camchain(const YamlFields& fields) {
  RigCalibration result;
  const YamlFields first = fields.child("cam0");
  result.body_is_imu = first.has("T_cam_imu");
  result.rig.cameras.push_back(camera_of(first));
  result.rig.body_from_camera.push_back(result.body_is_imu ? first.transform("T_cam_imu").inverse()
                                                           : SE3());
  for (int i = 1; fields.has("cam" + std::to_string(i)); ++i) {
    const YamlFields camera = fields.child("cam" + std::to_string(i));
    result.rig.cameras.push_back(camera_of(camera));
    result.rig.body_from_camera.push_back(body_from_chained_camera(camera, result));
  }
  return result;
}

double positive(const YamlFields& fields, const std::string& key) {
  const double value = fields.number(key);
  if (!(value > 0)) fields.fail("'" + key + "' is not positive");
  return value;
}

}  // namespace

RigCalibration read_rig_calibration(const std::filesystem::path& file) {
  const YamlFields fields = YamlFields::load(file);
  return fields.has("cam0") ? read_camchain(fields) : read_sensor(fields);
}

ImuFileCalibration read_imu_calibration(const std::filesystem::path& file) {
  const YamlFields whole = YamlFields::load(file);
  const YamlFields fields = whole.has("imu0") ? whole.child("imu0") : whole;
  ImuFileCalibration result;
  result.imu.gyroscope_noise = positive(fields, "gyroscope_noise_density");
  result.imu.gyroscope_walk = positive(fields, "gyroscope_random_walk");
  result.imu.accelerometer_noise = positive(fields, "accelerometer_noise_density");
  result.imu.accelerometer_walk = positive(fields, "accelerometer_random_walk");
  result.imu.rate = positive(fields, fields.has("rate_hz") ? "rate_hz" : "update_rate");
  if (fields.has("T_BS")) result.body_from_imu = fields.transform("T_BS");
  return result;
}

}  // namespace rover
