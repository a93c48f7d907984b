#include "rover/optimization/inertial_bundle_adjustment.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "rover/base/error.h"
#include "rover/optimization/inertial_model.h"

namespace rover {
namespace {

void check_problem(const InertialBundleProblem& problem) {
  check_indices(problem.bundle);
  const std::size_t poses = problem.bundle.world_from_body.size();
  if (problem.velocity.size() != poses || problem.bias.size() != poses)
    throw std::invalid_argument("inertial adjustment: a pose is without velocity or bias");
  const auto valid = [&](int pose) { return pose >= 0 && static_cast<std::size_t>(pose) < poses; };
  for (const InertialLink& link : problem.links) {
    if (!valid(link.from) || !valid(link.to) || link.from == link.to)
      throw std::invalid_argument("inertial adjustment: a link's index is out of range");
  }
  for (const PlacedPrior& prior : problem.priors) {
    if (!valid(prior.pose))
      throw std::invalid_argument("inertial adjustment: a prior's index is out of range");
  }
}

void reintegrate(InertialBundleProblem& problem) {
  for (InertialLink& link : problem.links) {
    const ImuBias& bias = problem.bias[link.from];
    if (link.motion.is_far(bias)) link.motion.reintegrate(bias);
  }
}

MinimizationResult minimize(InertialBundleProblem& problem, const BundlePass& pass) {
  reintegrate(problem);
  InertialBundleModel model(problem, pass);
  LevenbergMarquardt<InertialBundleModel> solver(model, InertialBundleModel::initial(problem));
  const MinimizationResult result = solver.run(pass.limits());
  InertialBundleModel::write(solver.state(), problem);
  return result;
}

// The pose that is fixed, or else that holds the gauge.
int anchor_of(const BundleProblem& bundle) {
  const auto& fixed = bundle.pose_fixed;
  const auto first = std::find_if(fixed.begin(), fixed.end(), [](char f) { return f != 0; });
  return first == fixed.end() ? 0 : static_cast<int>(first - fixed.begin());
}

// Covariance of the difference of two positions in the world; a row below zero is a fixed one.
Eigen::Matrix3d difference_covariance(const BundleProblem& bundle, const InertialBundleModel& model,
                                      const Eigen::MatrixXd& covariance, int a, int b) {
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3, covariance.rows());
  const auto set = [&](int pose, double sign) {
    if (model.row(pose) < 0) return;
    jacobian.middleCols<3>(model.row(pose)) = sign * bundle.world_from_body[pose].rotation_matrix();
  };
  set(a, -1);
  set(b, 1);
  return jacobian * covariance * jacobian.transpose();
}

// How uncertain the distance from the anchor to the farthest free pose is, relative to itself.
double scale_sigma(const BundleProblem& bundle, const InertialBundleModel& model,
                   const Eigen::MatrixXd& covariance) {
  const int anchor = anchor_of(bundle);
  Eigen::Vector3d longest = Eigen::Vector3d::Zero();
  int farthest = -1;
  for (std::size_t pose = 0; pose < bundle.world_from_body.size(); ++pose) {
    const Eigen::Vector3d way =
        bundle.world_from_body[pose].translation - bundle.world_from_body[anchor].translation;
    if (bundle.pose_fixed[pose] || way.norm() <= longest.norm()) continue;
    longest = way;
    farthest = static_cast<int>(pose);
  }
  if (farthest < 0) return 0;
  const Eigen::Vector3d direction = longest.normalized();
  const Eigen::Matrix3d spread = difference_covariance(bundle, model, covariance, anchor, farthest);
  return std::sqrt(std::max(0.0, direction.dot(spread * direction))) / longest.norm();
}

void add_covariance(const InertialBundleProblem& problem, const InertialBundleOptions& options,
                    InertialBundleSummary& summary) {
  if (!options.covariance && options.covariance_of < 0) return;
  const ScaleGauge gauge;
  InertialBundleModel model(problem, {summary.visual.inliers, gauge, options.bundle, 0});
  InertialBundleModel::Equations equations;
  model.linearize(InertialBundleModel::initial(problem), equations);
  if (options.covariance_of >= 0)
    summary.state_covariance = model.covariance_of(options.covariance_of, equations);
  if (!options.covariance) return;
  const Eigen::MatrixXd covariance = model.covariance(equations);
  if (covariance.rows() == 0) return;
  const std::size_t poses = problem.bundle.world_from_body.size();
  summary.covariance.assign(poses, Matrix15d::Zero());
  for (std::size_t pose = 0; pose < poses; ++pose) {
    const int row = model.row(static_cast<int>(pose));
    if (row >= 0) summary.covariance[pose] = covariance.block<15, 15>(row, row);
  }
  summary.scale_sigma = scale_sigma(problem.bundle, model, covariance);
}

}  // namespace

InertialBundleSummary adjust_inertial_bundle(InertialBundleProblem& problem,
                                             const InertialBundleOptions& options) {
  options.check();
  check_problem(problem);
  if (options.covariance_of >= static_cast<int>(problem.velocity.size()))
    throw std::invalid_argument("inertial adjustment: covariance_of is out of range");
  const auto initial_velocity = problem.velocity;
  const auto initial_bias = problem.bias;
  InertialBundleSummary summary;
  summary.visual =
      adjust_in_two_passes(problem.bundle, options.bundle,
                           [&](const BundlePass& pass) { return minimize(problem, pass); });
  if (!summary.visual.usable) {
    problem.velocity = initial_velocity;
    problem.bias = initial_bias;
    return summary;
  }
  for (const InertialLink& link : problem.links) {
    const Vector15d residual = imu_residual(link.motion, problem.state(link.from),
                                            problem.state(link.to), problem.gravity);
    summary.link_chi2.push_back(residual.head<9>().squaredNorm());
  }
  add_covariance(problem, options, summary);
  return summary;
}

void InertialBundleOptions::check() const {
  bundle.check();
  require(!bundle.fix_scale, "inertial adjustment: fix_scale must be off: gravity holds the scale");
}

}  // namespace rover
