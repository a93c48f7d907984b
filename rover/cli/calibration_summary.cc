#include "rover/cli/calibration_summary.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

namespace rover {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegree = M_PI / 180;

Json list_of(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

Json rows_of(const SE3& transform) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = transform.matrix();
  return std::vector<double>(matrix.data(), matrix.data() + matrix.size());
}

double length_of(const Json& list) {
  return Eigen::Vector3d(list[0].get<double>(), list[1].get<double>(), list[2].get<double>())
      .norm();
}

double largest_of(const Json& list) {
  return std::max({list[0].get<double>(), list[1].get<double>(), list[2].get<double>()});
}

Json describe_offset(const CalibrationStatus& status, const Config& config) {
  const double found = seconds_between(0, status.time_offset);
  return {{"given_s", config.imu_time_offset},
          {"value_s", config.imu_time_offset + found},
          {"sigma_s", status.time_sigma}};
}

Json describe_extrinsics(const Map& map) {
  const CalibrationStatus& status = map.calibration();
  const SE3& now = map.rig().body_from_camera[0];
  const SE3 given = status.given.value_or(now);
  const Vector6d change = se3_minus(now, given);
  return {{"body_from_camera", rows_of(now)},
          {"rotation_change_deg", list_of(change.tail<3>() / kDegree)},
          {"rotation_sigma_deg", list_of(status.rotation_sigma / kDegree)},
          {"translation_change_m", list_of(change.head<3>())},
          {"translation_sigma_m", list_of(status.translation_sigma)}};
}

std::string offset_for_people(const Json& offset) {
  return fmt::format("clock offset {:.2f} ms (standard deviation {:.2f}, given {:.2f}); ",
                     1e3 * offset["value_s"].get<double>(), 1e3 * offset["sigma_s"].get<double>(),
                     1e3 * offset["given_s"].get<double>());
}

std::string extrinsics_for_people(const Json& extrinsics) {
  return fmt::format(
      "cameras turned by {:.2f} degrees ({:.2f}) and moved by {:.1f} mm ({:.1f}) in the body; ",
      length_of(extrinsics["rotation_change_deg"]), largest_of(extrinsics["rotation_sigma_deg"]),
      1e3 * length_of(extrinsics["translation_change_m"]),
      1e3 * largest_of(extrinsics["translation_sigma_m"]));
}

}  // namespace

Json describe_calibration(const Map& map, const Config& config) {
  const CalibrationStatus& status = map.calibration();
  const CalibrationOptions& options = config.mapping.inertial.calibration;
  Json json;
  if (options.time_offset) json["time_offset"] = describe_offset(status, config);
  if (options.extrinsics) json["extrinsics"] = describe_extrinsics(map);
  json["estimates"] = status.estimates;
  json["changes"] = status.changes;
  json["settled"] = status.settled;
  json["missing"] = status.missing;
  return json;
}

std::string calibration_for_people(const Json& json) {
  std::string text = "calibration  ";
  const bool is_estimated = json["estimates"].get<int>() > 0 || json["changes"].get<int>() > 0;
  if (!is_estimated) text += "as given, not estimated yet; ";
  if (is_estimated && json.contains("time_offset")) text += offset_for_people(json["time_offset"]);
  if (json["estimates"].get<int>() > 0 && json.contains("extrinsics"))
    text += extrinsics_for_people(json["extrinsics"]);
  const std::string missing = json["missing"].get<std::string>();
  text += json["settled"].get<bool>() ? "settled" : "still being estimated";
  return text + (missing.empty() ? "\n" : ": " + missing + "\n");
}

}  // namespace rover
