#include "rover/optimization/pose_optimization.h"

#include <algorithm>
#include <optional>

#include <Eigen/Cholesky>

#include "rover/base/error.h"
#include "rover/optimization/damping.h"
#include "rover/optimization/pose_residuals.h"

namespace rover {
namespace {

constexpr int kMinInliers = 4;  // three leave up to four solutions and no check

// A step with a smaller predicted decrease of half the chi-square moves the estimate by less than
// a hundredth of its own standard deviation: it is taken without looking, and is the last.
constexpr double kNegligibleDecrease = 5e-5;

Vector6d damped_step(const PoseEquations& equations, const Damping& damping) {
  Matrix6d damped = equations.hessian;
  for (int i = 0; i < 6; ++i) damped(i, i) += damping.of(equations.hessian(i, i));
  return damped.ldlt().solve(-equations.gradient);
}

double predicted_decrease(const PoseEquations& equations, const Vector6d& step) {
  return -step.dot(equations.gradient + 0.5 * equations.hessian * step);
}

// One round: Levenberg-Marquardt on the selected observations.
SE3 descend(const PoseResiduals& residuals, SE3 pose, const PoseOptimizationOptions& options) {
  Damping damping;
  PoseEquations current = residuals.linearize(pose);
  for (int i = 0; i < options.iterations && !damping.exhausted(); ++i) {
    const Vector6d step = damped_step(current, damping);
    const double predicted = predicted_decrease(current, step);
    const SE3 candidate = se3_plus(pose, step);
    if (step.norm() < options.min_step || predicted < kNegligibleDecrease) return candidate;
    const PoseEquations next = residuals.linearize(candidate);
    if (next.cost <= current.cost) {
      damping.accept((current.cost - next.cost) / std::max(predicted, 1e-300));
      pose = candidate;
      current = next;
    } else {
      damping.reject();
    }
  }
  return pose;
}

// The inverse, if all directions are observed: judged after scaling to a unit diagonal, where
// metres and radians compare.
std::optional<Matrix6d> invert(const Matrix6d& hessian) {
  if (!(hessian.diagonal().minCoeff() > 0) || !hessian.allFinite()) return std::nullopt;
  const Vector6d scale = hessian.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Matrix6d> factors(scale.asDiagonal() * hessian * scale.asDiagonal());
  if (!(factors.vectorD().minCoeff() > 1e-10)) return std::nullopt;
  const Matrix6d inverse = factors.solve(Matrix6d::Identity());
  return scale.asDiagonal() * (0.5 * (inverse + inverse.transpose())) * scale.asDiagonal();
}

void finish(const PoseResiduals& residuals, const SE3& pose, PoseEstimate& estimate) {
  estimate.inliers = residuals.selected();
  estimate.inlier_count = residuals.selected_count();
  if (estimate.inlier_count == 0) return;
  const PoseEquations equations = residuals.linearize(pose);
  estimate.mean_chi2 = equations.chi2 / estimate.inlier_count;
  if (estimate.inlier_count < kMinInliers) return;
  const auto covariance = invert(equations.hessian);
  if (!covariance) return;
  estimate.world_from_body = pose;
  estimate.covariance = *covariance * std::max(1.0, estimate.mean_chi2 / 2);
  estimate.converged = true;
}

}  // namespace

void PoseOptimizationOptions::check() const {
  require(rounds > 0, "pose optimisation: rounds must be positive, not {}", rounds);
  require(iterations > 0, "pose optimisation: iterations must be positive, not {}", iterations);
  require(chi2 > 0, "pose optimisation: chi2 must be positive, not {}", chi2);
  require(huber > 0, "pose optimisation: huber must be positive, not {}", huber);
  require(min_step >= 0, "pose optimisation: min_step must not be negative, but is {}", min_step);
}

PoseEstimate optimize_pose(const Rig& rig, const SE3& world_from_body,
                           std::span<const PoseObservation> observations,
                           const PoseOptimizationOptions& options) {
  options.check();
  PoseResiduals residuals(rig, observations, options.chi2, options.huber);
  PoseEstimate estimate;
  estimate.world_from_body = world_from_body;
  SE3 pose = world_from_body;
  for (int round = 0; round < options.rounds; ++round) {
    if (residuals.selected_count() < kMinInliers) break;
    pose = descend(residuals, pose, options);
    if (!residuals.select(pose)) break;
  }
  finish(residuals, pose, estimate);
  return estimate;
}

}  // namespace rover
