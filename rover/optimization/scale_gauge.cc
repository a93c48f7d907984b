#include "rover/optimization/scale_gauge.h"

#include <algorithm>

namespace rover {

ScaleGauge ScaleGauge::of(const BundleProblem& problem, const BundleOptions& options) {
  ScaleGauge gauge;
  const auto& fixed = problem.pose_fixed;
  const auto first = std::find_if(fixed.begin(), fixed.end(), [](char f) { return f != 0; });
  if (!options.fix_scale || first == fixed.end()) return gauge;
  gauge.anchor = problem.world_from_body[first - fixed.begin()].translation;
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    const double distance = (problem.world_from_body[i].translation - gauge.anchor).norm();
    if (fixed[i] && distance > 0) return {};
    if (fixed[i] || distance <= gauge.distance) continue;
    gauge.pose = static_cast<int>(i);
    gauge.distance = distance;
  }
  return gauge;
}

Vector6d ScaleGauge::held_direction(const SE3& world_from_body) const {
  Vector6d direction = Vector6d::Zero();
  direction.head<3>() =
      world_from_body.rotation.conjugate() * (world_from_body.translation - anchor).normalized();
  return direction;
}

SE3 ScaleGauge::restored(const SE3& world_from_body) const {
  return {world_from_body.rotation,
          anchor + distance * (world_from_body.translation - anchor).normalized()};
}

}  // namespace rover
