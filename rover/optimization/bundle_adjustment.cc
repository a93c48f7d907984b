#include "rover/optimization/bundle_adjustment.h"

#include <algorithm>
#include <stdexcept>

#include "rover/base/error.h"
#include "rover/optimization/bundle_ceres.h"
#include "rover/optimization/schur_solver.h"

namespace rover {
namespace {

// Beyond this many free poses the dense reduced system of SchurComplement loses to a sparse one.
constexpr int kSchurPoses = 300;

void check_problem(const BundleProblem& problem) {
  check_indices(problem);
  const auto is_fixed = [](char fixed) { return fixed != 0; };
  if (!problem.observations.empty() &&
      std::none_of(problem.pose_fixed.begin(), problem.pose_fixed.end(), is_fixed))
    throw std::invalid_argument("bundle adjustment: at least one pose must be fixed");
}

int free_poses(const BundleProblem& problem) {
  return static_cast<int>(std::count(problem.pose_fixed.begin(), problem.pose_fixed.end(), 0));
}

MinimizationResult minimize(BundleProblem& problem, const BundlePass& pass) {
  BundleSolver solver = pass.options.solver;
  if (solver == BundleSolver::kAutomatic)
    solver = free_poses(problem) <= kSchurPoses ? BundleSolver::kSchur : BundleSolver::kCeres;
  return solver == BundleSolver::kSchur ? minimize_with_schur(problem, pass)
                                        : minimize_with_ceres(problem, pass);
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
  return adjust_in_two_passes(problem, options,
                              [&](const BundlePass& pass) { return minimize(problem, pass); });
}

}  // namespace rover
