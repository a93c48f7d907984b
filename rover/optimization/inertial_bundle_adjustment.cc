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
  if (problem.border != -1 &&
      (!valid(problem.border) || !problem.bundle.pose_fixed[problem.border]))
    throw std::invalid_argument("inertial adjustment: the border must be a fixed pose");
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

Eigen::Vector3d middle_of(const std::vector<SE3>& poses) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const SE3& pose : poses) sum += pose.translation;
  return sum / static_cast<double>(poses.size());
}

// The logarithm of the scale that fits moved positions best changes by the mean of their steps
// along their ways from the middle, sum(way . step) / sum(way . way): its derivative by the states.
Eigen::VectorXd scale_by_states(const BundleProblem& bundle, const InertialBundleModel& model,
                                Eigen::Index unknowns) {
  const Eigen::Vector3d middle = middle_of(bundle.world_from_body);
  Eigen::VectorXd by_states = Eigen::VectorXd::Zero(unknowns);
  double square = 0;
  for (std::size_t pose = 0; pose < bundle.world_from_body.size(); ++pose) {
    const SE3& body = bundle.world_from_body[pose];
    const Eigen::Vector3d way = body.translation - middle;
    square += way.squaredNorm();
    const int row = model.row(static_cast<int>(pose));
    if (row >= 0) by_states.segment<3>(row) = body.rotation.conjugate() * way;
  }
  return by_states / std::max(square, 1e-12);
}

void add_covariance(const Eigen::MatrixXd& covariance, const InertialBundleModel& model,
                    InertialBundleSummary& summary, std::size_t poses) {
  if (covariance.rows() == 0) return;
  summary.covariance.assign(poses, Matrix15d::Zero());
  for (std::size_t pose = 0; pose < poses; ++pose) {
    const int row = model.row(static_cast<int>(pose));
    if (row >= 0) summary.covariance[pose] = covariance.block<15, 15>(row, row);
  }
}

void add_scale_sigma(const InertialBundleProblem& problem,
                     const InertialBundleModel::Equations& equations, InertialBundleModel& model,
                     InertialBundleSummary& summary) {
  const Eigen::VectorXd by_states =
      scale_by_states(problem.bundle, model, equations.states.hessian.rows());
  const auto with_scale = model.covariance_times(equations, by_states);
  if (!with_scale) return;
  const double variance = by_states.dot(with_scale->col(0));
  if (variance > 0) summary.scale_sigma = std::sqrt(variance);
  summary.with_scale.assign(problem.velocity.size(), Vector15d::Zero());
  for (std::size_t pose = 0; pose < summary.with_scale.size(); ++pose) {
    const int row = model.row(static_cast<int>(pose));
    if (row >= 0) summary.with_scale[pose] = with_scale->col(0).segment<15>(row);
  }
}

void add_seen(const InertialBundleProblem& problem, const InertialBundleModel::Equations& equations,
              const InertialBundleModel& model, InertialBundleSummary& summary) {
  summary.seen.assign(problem.velocity.size(), Matrix6d::Zero());
  for (std::size_t i = 0; i < summary.seen.size(); ++i) {
    const int pose = static_cast<int>(i);
    if (!problem.bundle.pose_fixed[i]) summary.seen[i] = model.seen_information(pose, equations);
  }
}

// Of one state. It depends on fixed poses, or on the scale that nothing fixes.
void add_state(const InertialBundleProblem& problem, int pose,
               const InertialBundleModel::Equations& equations, InertialBundleModel& model,
               InertialBundleSummary& summary) {
  summary.state_covariance = model.covariance_of(pose, equations);
  if (std::ranges::count(problem.bundle.pose_fixed, 1) == 0) {
    add_scale_sigma(problem, equations, model, summary);
    return;
  }
  const auto response = model.response(InertialBundleModel::initial(problem), equations);
  const int row = model.row(pose);
  if (response && row >= 0) summary.state_response = response->middleRows<15>(row);
}

void add_uncertainty(const InertialBundleProblem& problem, const InertialBundleOptions& options,
                     InertialBundleSummary& summary) {
  if (!options.covariance && !options.scale_sigma && options.covariance_of < 0) return;
  const ScaleGauge gauge;
  InertialBundleModel model(problem, {summary.visual.inliers, gauge, options.bundle, 0});
  InertialBundleModel::Equations equations;
  model.linearize(InertialBundleModel::initial(problem), equations);
  add_seen(problem, equations, model, summary);
  if (options.covariance_of >= 0) {
    add_state(problem, options.covariance_of, equations, model, summary);
  }
  if (options.covariance || options.scale_sigma)
    add_scale_sigma(problem, equations, model, summary);
  if (options.covariance) {
    add_covariance(model.covariance(equations), model, summary, problem.velocity.size());
  }
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
  add_uncertainty(problem, options, summary);
  return summary;
}

void InertialBundleOptions::check() const {
  bundle.check();
  require(!bundle.fix_scale, "inertial adjustment: fix_scale must be off: gravity holds the scale");
}

}  // namespace rover
