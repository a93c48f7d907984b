#include "rover/simulation/motion_fit_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "rover/base/error.h"
#include "rover/simulation/spline_jacobians.h"

namespace rover {
namespace {

// Order of the shared unknowns: offset, two of tilt, then six for each node of the biases.
constexpr int kOffset = 0, kTilt = 1, kBiases = 3;

// What is expected before looking: weak, for flights that do not show it.
constexpr double kOffsetSigma = 0.05;            // s
constexpr double kGyroscopeBiasSigma = 0.2;      // rad/s
constexpr double kAccelerometerBiasSigma = 0.5;  // m/s^2
constexpr double kGyroscopeWalk = 2e-4;          // rad/s/sqrt(s)
constexpr double kAccelerometerWalk = 5e-3;      // m/s^2/sqrt(s)

constexpr double kHuber = 3;           // standard deviations
constexpr double kConvergence = 1e-6;  // relative change of the cost

// Iteratively reweighted least squares for Huber's kernel on the length of a vector.
struct Robust {
  double weight, cost;
};
Robust huber(double length) {
  if (length <= kHuber) return {1, 0.5 * length * length};
  return {kHuber / length, kHuber * (length - 0.5 * kHuber)};
}

SE3 interpolate(const std::vector<MotionFitProblem::Pose>& poses, double seconds) {
  const auto after = std::partition_point(poses.begin(), poses.end(),
                                          [&](const auto& pose) { return pose.seconds < seconds; });
  if (after == poses.begin()) return poses.front().world_from_body;
  if (after == poses.end()) return poses.back().world_from_body;
  const auto& from = *(after - 1);
  const double share = (seconds - from.seconds) / (after->seconds - from.seconds);
  const SE3 &a = from.world_from_body, &b = after->world_from_body;
  return {a.rotation.slerp(share, b.rotation),
          a.translation + share * (b.translation - a.translation)};
}

SplineMotion initial_motion(const std::vector<MotionFitProblem::Pose>& poses, double duration,
                            double knot_interval) {
  const int intervals = std::max(1, static_cast<int>(std::lround(duration / knot_interval)));
  const double step = duration / intervals;
  std::vector<SE3> control;
  for (int i = 0; i < intervals + kSplineOrder - 1; ++i) {
    control.push_back(interpolate(poses, (i - 2) * step));
  }
  return {0, step, std::move(control)};
}

std::vector<BiasNode> initial_biases(double duration, double interval) {
  const int intervals = std::max(1, static_cast<int>(std::lround(duration / interval)));
  std::vector<BiasNode> nodes;
  for (int i = 0; i <= intervals; ++i) nodes.push_back({duration * i / intervals, {}});
  return nodes;
}

// Where a time lies between the nodes.
struct BiasPlace {
  int node;      // and the next one
  double share;  // of the next one
};
BiasPlace bias_place(const std::vector<BiasNode>& nodes, double seconds) {
  const double step = nodes[1].seconds - nodes[0].seconds;
  const int last = static_cast<int>(nodes.size()) - 2;
  const double steps = std::clamp(seconds / step, 0.0, last + 1.0);
  const int node = std::min(static_cast<int>(steps), last);
  return {node, steps - node};
}

void set_rotation_part(const std::array<Eigen::Matrix3d, kSplineOrder>& jacobians,
                       const Eigen::Matrix3d& factor, SplineResidual& residual) {
  for (int j = 0; j < kSplineOrder; ++j) {
    residual.by_control.middleCols<3>(6 * j + 3) = factor * jacobians[j];
  }
}

void set_position_part(const SplineBasis::Weights& weights, const Eigen::Matrix3d& factor,
                       SplineResidual& residual) {
  for (int j = 0; j < kSplineOrder; ++j) {
    residual.by_control.middleCols<3>(6 * j) = weights[j] * factor;
  }
}

SplineBasis basis_at(const SplineMotion& motion, double seconds) {
  return SplineBasis::at(motion.place_of(seconds).u, motion.knot_interval());
}

}  // namespace

double root_mean_square(const std::vector<Eigen::Vector3d>& values) {
  if (values.empty()) return 0;
  double sum = 0;
  for (const Eigen::Vector3d& value : values) sum += value.squaredNorm();
  return std::sqrt(sum / static_cast<double>(values.size()));
}

ImuBias bias_at(const std::vector<BiasNode>& nodes, double seconds) {
  if (nodes.empty()) return {};
  const auto [node, share] = bias_place(nodes, seconds);
  return ImuBias::from_vector((1 - share) * nodes[node].bias.vector() +
                              share * nodes[node + 1].bias.vector());
}

MotionFitProblem::MotionFitProblem(std::vector<Pose> poses, std::vector<Reading> readings,
                                   double duration, double knot_interval,
                                   const MotionFitOptions& options)
    : options_(options),
      poses_(std::move(poses)),
      readings_(std::move(readings)),
      motion_(initial_motion(poses_, duration, knot_interval)),
      gravity_(0, 0, -options.gravity) {
  if (!readings_.empty()) biases_ = initial_biases(duration, options.bias_interval);
}

int MotionFitProblem::shared_count() const {
  return biases_.empty() ? 0 : kBiases + 6 * static_cast<int>(biases_.size());
}

SplineResidual MotionFitProblem::position_residual(const Pose& pose) const {
  const double seconds = pose.seconds + time_offset_;
  const MotionState state = motion_.at(seconds);
  SplineResidual residual;
  residual.first = motion_.place_of(seconds).first;
  residual.value = state.world_from_body.translation - pose.world_from_body.translation;
  set_position_part(basis_at(motion_, seconds).value, Eigen::Matrix3d::Identity(), residual);
  if (biases_.empty()) return residual;
  residual.shared = {kOffset};
  residual.by_shared.col(0) = state.velocity;
  return residual;
}

SplineResidual MotionFitProblem::rotation_residual(const Pose& pose) const {
  const double seconds = pose.seconds + time_offset_;
  const MotionState state = motion_.at(seconds);
  SplineResidual residual;
  residual.first = motion_.place_of(seconds).first;
  residual.value =
      so3_log(pose.world_from_body.rotation.conjugate() * state.world_from_body.rotation);
  const Eigen::Matrix3d inverse = so3_right_jacobian_inverse(residual.value);
  set_rotation_part(SplineJacobians::at(motion_, seconds).orientation, inverse, residual);
  if (biases_.empty()) return residual;
  residual.shared = {kOffset};
  residual.by_shared.col(0) = inverse * state.angular_velocity;
  return residual;
}

void MotionFitProblem::add_bias(double seconds, bool gyroscope, SplineResidual& residual) const {
  const ImuBias bias = bias_at(biases_, seconds);
  residual.value += gyroscope ? bias.gyroscope : bias.accelerometer;
  const auto [node, share] = bias_place(biases_, seconds);
  for (int axis = 0; axis < 3; ++axis) {
    const int unknown = kBiases + 6 * node + (gyroscope ? 0 : 3) + axis;
    for (const auto& [index, weight] : {std::pair(unknown, 1 - share), {unknown + 6, share}}) {
      residual.by_shared(axis, static_cast<int>(residual.shared.size())) = weight;
      residual.shared.push_back(index);
    }
  }
}

SplineResidual MotionFitProblem::gyroscope_residual(const Reading& reading) const {
  const MotionState state = motion_.at(reading.seconds);
  SplineResidual residual;
  residual.first = motion_.place_of(reading.seconds).first;
  residual.value = state.angular_velocity - reading.angular_velocity;
  set_rotation_part(SplineJacobians::at(motion_, reading.seconds).angular_velocity,
                    Eigen::Matrix3d::Identity(), residual);
  add_bias(reading.seconds, true, residual);
  return residual;
}

SplineResidual MotionFitProblem::accelerometer_residual(const Reading& reading) const {
  const MotionState state = motion_.at(reading.seconds);
  const Eigen::Matrix3d body_from_world =
      state.world_from_body.rotation.conjugate().toRotationMatrix();
  const Eigen::Vector3d force = body_from_world * (state.acceleration - gravity_);
  SplineResidual residual;
  residual.first = motion_.place_of(reading.seconds).first;
  residual.value = force - reading.acceleration;
  set_position_part(basis_at(motion_, reading.seconds).second, body_from_world, residual);
  set_rotation_part(SplineJacobians::at(motion_, reading.seconds).orientation, skew(force),
                    residual);
  // Gravity is turned on the left, about the world's x and y axes.
  residual.shared = {kTilt, kTilt + 1};
  residual.by_shared.leftCols<2>() = body_from_world * skew(gravity_).leftCols<2>();
  add_bias(reading.seconds, false, residual);
  return residual;
}

void MotionFitProblem::add_priors(SplineEquations& equations) const {
  const auto add = [&](int unknown, double value, double sigma, int minus = -1) {
    Eigen::VectorXd jacobian = Eigen::VectorXd::Unit(shared_count(), unknown);
    if (minus >= 0) jacobian[minus] = -1;
    equations.add_shared(jacobian, value, 1 / (sigma * sigma));
  };
  add(kOffset, time_offset_, kOffsetSigma);
  for (std::size_t i = 0; i < biases_.size(); ++i) {
    const Vector6d bias = biases_[i].bias.vector();
    for (int k = 0; k < 6; ++k) {
      const int unknown = kBiases + 6 * static_cast<int>(i) + k;
      add(unknown, bias[k], k < 3 ? kGyroscopeBiasSigma : kAccelerometerBiasSigma);
      if (i == 0) continue;
      const double walk = (k < 3 ? kGyroscopeWalk : kAccelerometerWalk) *
                          std::sqrt(biases_[i].seconds - biases_[i - 1].seconds);
      add(unknown, bias[k] - biases_[i - 1].bias.vector()[k], walk, unknown - 6);
    }
  }
}

double MotionFitProblem::build(SplineEquations& equations) const {
  double cost = 0;
  const auto add = [&](const SplineResidual& residual, double sigma) {
    const Robust robust = huber(residual.value.norm() / sigma);
    cost += robust.cost;
    equations.add(residual, robust.weight / (sigma * sigma));
  };
  for (const Pose& pose : poses_) {
    add(position_residual(pose), options_.position_sigma);
    add(rotation_residual(pose), options_.rotation_sigma);
  }
  for (const Reading& reading : readings_) {
    add(gyroscope_residual(reading), options_.gyroscope_sigma);
    add(accelerometer_residual(reading), options_.accelerometer_sigma);
  }
  if (!biases_.empty()) add_priors(equations);
  return cost;
}

void MotionFitProblem::step(const Eigen::VectorXd& delta) {
  std::vector<SE3> control = motion_.control();
  for (std::size_t i = 0; i < control.size(); ++i) {
    const Vector6d d = delta.segment<6>(6 * static_cast<Eigen::Index>(i));
    control[i].translation += d.head<3>();
    control[i].rotation = (control[i].rotation * so3_exp(d.tail<3>())).normalized();
  }
  motion_ = SplineMotion(0, motion_.knot_interval(), std::move(control));
  if (biases_.empty()) return;
  const Eigen::VectorXd shared = delta.tail(shared_count());
  time_offset_ += shared[kOffset];
  gravity_ = so3_exp({shared[kTilt], shared[kTilt + 1], 0}) * gravity_;
  for (std::size_t i = 0; i < biases_.size(); ++i) {
    const Vector6d d = shared.segment<6>(kBiases + 6 * static_cast<Eigen::Index>(i));
    biases_[i].bias = ImuBias::from_vector(biases_[i].bias.vector() + d);
  }
}

void MotionFitProblem::iterate() {
  double last_cost = std::numeric_limits<double>::infinity();
  for (int i = 0; i < options_.max_iterations; ++i) {
    SplineEquations equations(static_cast<int>(motion_.control().size()), shared_count());
    const double cost = build(equations);
    if (std::abs(last_cost - cost) <= kConvergence * cost) return;
    last_cost = cost;
    const auto delta = equations.solve();
    require(delta && delta->allFinite(), "flight: the ground truth does not determine a motion");
    step(*delta);
  }
}

void MotionFitProblem::weigh_readings() {
  const Residuals left = residuals();
  const auto lower = [](double& sigma, const std::vector<Eigen::Vector3d>& values) {
    sigma = std::min(sigma, std::max(root_mean_square(values) / std::sqrt(3), 0.02 * sigma));
  };
  lower(options_.gyroscope_sigma, left.gyroscope);
  lower(options_.accelerometer_sigma, left.accelerometer);
}

void MotionFitProblem::solve() {
  iterate();
  if (readings_.empty()) return;
  weigh_readings();
  iterate();
}

MotionFitProblem::Residuals MotionFitProblem::residuals() const {
  Residuals residuals;
  for (const Pose& pose : poses_) {
    residuals.position.push_back(position_residual(pose).value);
    residuals.rotation.push_back(rotation_residual(pose).value);
  }
  for (const Reading& reading : readings_) {
    residuals.gyroscope.push_back(gyroscope_residual(reading).value);
    residuals.accelerometer.push_back(accelerometer_residual(reading).value);
  }
  return residuals;
}

}  // namespace rover
