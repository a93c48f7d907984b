#include "rover/optimization/bundle_adjustment.h"

#include <algorithm>
#include <stdexcept>

#include "rover/base/error.h"
#include "rover/optimization/bundle_ceres.h"
#include "rover/optimization/reprojection.h"
#include "rover/optimization/robust_kernel.h"
#include "rover/optimization/schur_solver.h"

namespace rover {
namespace {

// Beyond this many free poses the dense reduced system of SchurSolver loses to a sparse one.
constexpr int kSchurPoses = 300;

void check_problem(const BundleProblem& problem) {
  const auto valid = [](int index, std::size_t size) {
    return index >= 0 && static_cast<std::size_t>(index) < size;
  };
  if (problem.pose_fixed.size() != problem.world_from_body.size())
    throw std::invalid_argument("bundle adjustment: pose_fixed and world_from_body differ in size");
  for (const BundleObservation& seen : problem.observations) {
    if (!valid(seen.pose, problem.world_from_body.size()) ||
        !valid(seen.point, problem.points.size()) ||
        !valid(seen.camera, problem.rig.cameras.size()))
      throw std::invalid_argument("bundle adjustment: an observation's index is out of range");
    if (!(seen.sigma > 0))
      throw std::invalid_argument("bundle adjustment: an observation's sigma is not positive");
  }
  const auto is_fixed = [](char fixed) { return fixed != 0; };
  if (!problem.observations.empty() &&
      std::none_of(problem.pose_fixed.begin(), problem.pose_fixed.end(), is_fixed))
    throw std::invalid_argument("bundle adjustment: at least one pose must be fixed");
}

std::vector<double> squared_residuals(const BundleProblem& problem) {
  const Reprojector reprojector(problem.rig);
  const std::vector<BodyFrame> frames(problem.world_from_body.begin(),
                                      problem.world_from_body.end());
  std::vector<double> result;
  result.reserve(problem.observations.size());
  for (const BundleObservation& seen : problem.observations) {
    const Eigen::Vector3d point = frames[seen.pose].from_world(problem.points[seen.point]);
    result.push_back(reprojector.chi2(seen.camera, point, seen.pixel, seen.sigma));
  }
  return result;
}

double robust_cost(const std::vector<double>& chi2, const BundleOptions& options) {
  const HuberKernel kernel{options.huber};
  double cost = 0;
  for (const double s : chi2) cost += 0.5 * kernel.rho(s);
  return cost;
}

std::vector<char> within(const std::vector<double>& chi2, double limit) {
  std::vector<char> result(chi2.size());
  std::transform(chi2.begin(), chi2.end(), result.begin(), [&](double s) { return s <= limit; });
  return result;
}

int free_poses(const BundleProblem& problem) {
  return static_cast<int>(std::count(problem.pose_fixed.begin(), problem.pose_fixed.end(), 0));
}

bool all_finite(const BundleProblem& problem) {
  const auto is_finite = [](const auto& values) { return values.allFinite(); };
  return std::all_of(problem.points.begin(), problem.points.end(), is_finite) &&
         std::all_of(problem.world_from_body.begin(), problem.world_from_body.end(),
                     [&](const SE3& pose) {
                       return is_finite(pose.translation) && is_finite(pose.rotation.coeffs());
                     });
}

BundlePassResult minimize(BundleProblem& problem, const BundlePass& pass) {
  BundleSolver solver = pass.options.solver;
  if (solver == BundleSolver::kAutomatic)
    solver = free_poses(problem) <= kSchurPoses ? BundleSolver::kSchur : BundleSolver::kCeres;
  return solver == BundleSolver::kSchur ? minimize_with_schur(problem, pass)
                                        : minimize_with_ceres(problem, pass);
}

// Both passes; whether the result can be used.
bool minimize_twice(BundleProblem& problem, const BundleOptions& options, BundleSummary& summary) {
  const ScaleGauge gauge = ScaleGauge::of(problem, options);
  const BundlePassResult first =
      minimize(problem, {summary.inliers, gauge, options, options.first_iterations});
  summary.iterations = first.iterations;
  if (!first.usable || first.stopped || options.second_iterations == 0) return first.usable;
  summary.inliers = within(squared_residuals(problem), options.chi2);
  const BundlePassResult second =
      minimize(problem, {summary.inliers, gauge, options, options.second_iterations});
  summary.iterations += second.iterations;
  return second.usable;
}

}  // namespace

void BundleOptions::check() const {
  require(first_iterations > 0, "bundle adjustment: first_iterations must be positive, not {}",
          first_iterations);
  require(second_iterations >= 0, "bundle adjustment: second_iterations must not be negative: {}",
          second_iterations);
  require(chi2 > 0, "bundle adjustment: chi2 must be positive, not {}", chi2);
  require(huber > 0, "bundle adjustment: huber must be positive, not {}", huber);
  require(min_relative_decrease >= 0,
          "bundle adjustment: min_relative_decrease must not be negative: {}",
          min_relative_decrease);
  require(threads > 0, "bundle adjustment: threads must be positive, not {}", threads);
}

BundleSummary adjust_bundle(BundleProblem& problem, const BundleOptions& options) {
  options.check();
  check_problem(problem);
  BundleSummary summary;
  if (problem.observations.empty()) return summary;
  const auto initial_poses = problem.world_from_body;
  const auto initial_points = problem.points;
  summary.inliers.assign(problem.observations.size(), 1);
  summary.initial_cost = robust_cost(squared_residuals(problem), options);
  summary.usable = all_finite(problem) && minimize_twice(problem, options, summary);
  if (!summary.usable) {
    problem.world_from_body = initial_poses;
    problem.points = initial_points;
  }
  const std::vector<double> chi2 = squared_residuals(problem);
  summary.final_cost = robust_cost(chi2, options);
  summary.inliers = within(chi2, options.chi2);
  return summary;
}

}  // namespace rover
