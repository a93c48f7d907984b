#include "rover/cli/states_csv.h"

#include <cmath>

#include <fmt/format.h>

#include "rover/optimization/drift.h"

namespace rover {
namespace {

// Of position (world axes) and the turn about the vertical since the map began.
Eigen::Vector4d world_sigma(const StateRecord& record) {
  const SE3& pose = record.state.world_from_body;
  const Matrix6d covariance =
      with_drift(pose, record.covariance.topLeftCorner<6, 6>(), record.drift);
  const Eigen::Matrix3d rotation = pose.rotation_matrix();
  const auto turned = [&](int at) {
    return Eigen::Vector3d(
        (rotation * covariance.block<3, 3>(at, at) * rotation.transpose()).diagonal());
  };
  Eigen::Vector4d variance;
  variance << turned(0), turned(3).z();
  return variance.cwiseSqrt();
}

}  // namespace

std::string states_csv(const std::vector<StateRecord>& states) {
  std::string text = "time";
  for (const char* prefix : {"", "sigma_"}) {
    for (const char* quantity : {"v", "bg", "ba"}) {
      for (const char axis : {'x', 'y', 'z'})
        text += fmt::format(",{}{}{}", prefix, quantity, axis);
    }
  }
  text += ",sigma_px,sigma_py,sigma_pz,sigma_yaw\n";
  for (const StateRecord& record : states) {
    const auto& [time, state, covariance, drift] = record;
    text += format_seconds(time);
    for (const double v : state.velocity) text += fmt::format(",{:.6f}", v);
    for (const double b : state.bias.vector()) text += fmt::format(",{:.7f}", b);
    for (int i = 6; i < 15; ++i) text += fmt::format(",{:.3e}", std::sqrt(covariance(i, i)));
    for (const double sigma : world_sigma(record)) text += fmt::format(",{:.3e}", sigma);
    text += '\n';
  }
  return text;
}

}  // namespace rover
