#include "rover/cli/states_csv.h"

#include <fmt/format.h>

#include "rover/optimization/drift.h"

namespace rover {
namespace {

// Of position (world axes) and the turn about the vertical since the map began.
Eigen::Vector4d world_sigma(const SE3& pose, const Matrix6d& here, const Eigen::Matrix4d& drift) {
  const Matrix6d covariance = with_drift(pose, here, drift);
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

StateRecord state_record(Timestamp time, const InertialState& state, const Matrix15d& covariance,
                         const Eigen::Matrix4d& drift) {
  return {time, state.velocity, state.bias, covariance.diagonal().tail<9>().cwiseSqrt(),
          world_sigma(state.world_from_body, covariance.topLeftCorner<6, 6>(), drift)};
}

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
    text += format_seconds(record.time);
    for (const double v : record.velocity) text += fmt::format(",{:.6f}", v);
    for (const double b : record.bias.vector()) text += fmt::format(",{:.7f}", b);
    for (const double sigma : record.sigma) text += fmt::format(",{:.3e}", sigma);
    for (const double sigma : record.drift_sigma) text += fmt::format(",{:.3e}", sigma);
    text += '\n';
  }
  return text;
}

}  // namespace rover
