#include "rover/simulation/spline_motion.h"

#include <algorithm>
#include <cmath>

#include "rover/base/error.h"

namespace rover {

SplineMotion::SplineMotion(double begin, double knot_interval, std::vector<SE3> control)
    : begin_(begin), knot_interval_(knot_interval), control_(std::move(control)) {
  require(knot_interval_ > 0, "spline: the knot interval must be positive");
  require(control_.size() >= kSplineOrder, "spline: {} control points; it takes {} or more",
          control_.size(), kSplineOrder);
  increments_.reserve(control_.size() - 1);
  for (std::size_t i = 1; i < control_.size(); ++i) {
    increments_.push_back(so3_log(control_[i - 1].rotation.conjugate() * control_[i].rotation));
  }
}

double SplineMotion::end() const {
  return begin_ + knot_interval_ * static_cast<double>(control_.size() - kSplineOrder + 1);
}

SplineMotion::Place SplineMotion::place_of(double seconds) const {
  const int last = static_cast<int>(control_.size()) - kSplineOrder;
  const double knots = std::clamp((seconds - begin_) / knot_interval_, 0.0, last + 1.0);
  const int first = std::min(static_cast<int>(knots), last);
  return {first, knots - first};
}

SE3 SplineMotion::pose_at(double seconds) const {
  const auto [first, u] = place_of(seconds);
  const SplineBasis basis = SplineBasis::at(u, knot_interval_);
  const SplineBasis cumulative = basis.cumulative();
  SE3 pose(control_[first].rotation, basis.value[0] * control_[first].translation);
  for (int j = 1; j < kSplineOrder; ++j) {
    pose.translation += basis.value[j] * control_[first + j].translation;
    pose.rotation = pose.rotation * so3_exp(cumulative.value[j] * rotation_increment(first + j));
  }
  pose.rotation.normalize();
  return pose;
}

MotionState SplineMotion::at(double seconds) const {
  const auto [first, u] = place_of(seconds);
  const SplineBasis basis = SplineBasis::at(u, knot_interval_);
  const SplineBasis cumulative = basis.cumulative();
  MotionState state;
  Eigen::Quaterniond& rotation = state.world_from_body.rotation;
  Eigen::Vector3d& omega = state.angular_velocity;
  Eigen::Vector3d& alpha = state.angular_acceleration;
  rotation = control_[first].rotation;
  for (int j = 0; j < kSplineOrder; ++j) {
    const Eigen::Vector3d& position = control_[first + j].translation;
    state.world_from_body.translation += basis.value[j] * position;
    state.velocity += basis.first[j] * position;
    state.acceleration += basis.second[j] * position;
    if (j == 0) continue;
    // The recursion of Sommer et al. for angular velocity and acceleration.
    const Eigen::Vector3d& increment = rotation_increment(first + j);
    const Eigen::Quaterniond turn = so3_exp(cumulative.value[j] * increment);
    const Eigen::Quaterniond back = turn.conjugate();
    rotation = rotation * turn;
    omega = back * omega + cumulative.first[j] * increment;
    alpha = back * alpha + cumulative.second[j] * increment +
            cumulative.first[j] * omega.cross(increment);
  }
  rotation.normalize();
  return state;
}

}  // namespace rover
