#include "rover/optimization/pose_optimization.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>

#include "rover/base/error.h"
#include "rover/optimization/damping.h"
#include "rover/optimization/reprojection.h"
#include "rover/optimization/robust_kernel.h"

namespace rover {
namespace {

constexpr int kMinInliers = 4;  // three leave up to four solutions and no check

// A step with a smaller predicted decrease of half the chi-square moves the estimate by less than
// a hundredth of its own standard deviation: it is taken without looking, and is the last.
constexpr double kNegligibleDecrease = 5e-5;

struct NormalEquations {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0;
  double chi2 = 0;  // sum of the squared residuals

  Vector6d step(const Damping& damping) const {
    Matrix6d damped = hessian;
    for (int i = 0; i < 6; ++i) damped(i, i) += damping.of(hessian(i, i));
    return damped.ldlt().solve(-gradient);
  }
  double predicted_decrease(const Vector6d& step) const {
    return -step.dot(gradient + 0.5 * hessian * step);
  }
};

class PoseSolver {
 public:
  PoseSolver(const Rig& rig, std::span<const PoseObservation> observations,
             const PoseOptimizationOptions& options)
      : observations_(observations),
        options_(options),
        reprojector_(rig),
        kernel_{options.huber},
        selected_(observations.size(), 1) {}

  // Selects the observations that fit the pose; whether that changed the selection.
  bool select(const SE3& pose) {
    const BodyFrame frame(pose);
    bool changed = false;
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      const char fits = chi2(frame, observations_[i]) <= options_.chi2;
      changed |= fits != selected_[i];
      selected_[i] = fits;
    }
    return changed;
  }

  NormalEquations linearize(const SE3& pose) const {
    const BodyFrame frame(pose);
    NormalEquations equations;
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      if (selected_[i]) add(frame, observations_[i], equations);
    }
    return equations;
  }

  // One round: Levenberg-Marquardt on the selected observations.
  SE3 descend(SE3 pose) const {
    Damping damping;
    NormalEquations current = linearize(pose);
    for (int i = 0; i < options_.iterations && !damping.exhausted(); ++i) {
      const Vector6d step = current.step(damping);
      const double predicted = current.predicted_decrease(step);
      const SE3 candidate = se3_plus(pose, step);
      if (step.norm() < options_.min_step || predicted < kNegligibleDecrease) return candidate;
      const NormalEquations next = linearize(candidate);
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

  const std::vector<char>& selected() const { return selected_; }
  int selected_count() const {
    return static_cast<int>(std::count(selected_.begin(), selected_.end(), 1));
  }

 private:
  double chi2(const BodyFrame& frame, const PoseObservation& seen) const {
    return reprojector_.chi2(seen.camera, frame.from_world(seen.point), seen.pixel, seen.sigma);
  }

  void add(const BodyFrame& frame, const PoseObservation& seen, NormalEquations& equations) const {
    const Eigen::Vector3d point = frame.from_world(seen.point);
    Eigen::Vector2d residual;
    Matrix23d jacobian;
    if (!reprojector_.evaluate(seen.camera, point, seen.pixel, seen.sigma, residual, &jacobian)) {
      equations.cost += 0.5 * kernel_.rho(kUnseenChi2);
      equations.chi2 += kUnseenChi2;
      return;
    }
    const double squared = residual.squaredNorm();
    equations.cost += 0.5 * kernel_.rho(squared);
    equations.chi2 += squared;
    const double weight = kernel_.weight(squared);
    if (weight == 0) return;
    PointInformation information;
    information.add(jacobian, residual, weight);
    information.add_to_pose(point, equations.hessian, equations.gradient);
  }

  std::span<const PoseObservation> observations_;
  const PoseOptimizationOptions& options_;
  Reprojector reprojector_;
  HuberKernel kernel_;
  std::vector<char> selected_;
};

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

void finish(const PoseSolver& solver, const SE3& pose, PoseEstimate& estimate) {
  estimate.inliers = solver.selected();
  estimate.inlier_count = solver.selected_count();
  if (estimate.inlier_count == 0) return;
  const NormalEquations equations = solver.linearize(pose);
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
  PoseSolver solver(rig, observations, options);
  PoseEstimate estimate;
  estimate.world_from_body = world_from_body;
  SE3 pose = world_from_body;
  for (int round = 0; round < options.rounds; ++round) {
    if (solver.selected_count() < kMinInliers) break;
    pose = solver.descend(pose);
    if (!solver.select(pose)) break;
  }
  finish(solver, pose, estimate);
  return estimate;
}

}  // namespace rover
