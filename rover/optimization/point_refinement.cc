#include "rover/optimization/point_refinement.h"

#include <algorithm>

#include <Eigen/Eigenvalues>

#include "rover/base/error.h"
#include "rover/optimization/damping.h"
#include "rover/optimization/reprojection.h"
#include "rover/optimization/robust_kernel.h"

namespace rover {
namespace {

// See pose_optimization.cc: the next step would be far below the point's own uncertainty.
constexpr double kNegligibleDecrease = 5e-5;

// Of the smallest to the largest eigenvalue of the information. The depth of a point d away, seen
// from two places b apart, has about (b / d)^2 of the information across: this is d = 10^4 b.
constexpr double kMinEigenvalueRatio = 1e-8;

struct PointEquations {
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  double chi2 = 0;
  double worst_chi2 = 0;
};

PointEquations linearize(const Reprojector& reprojector,
                         std::span<const PointObservation> observations,
                         const Eigen::Vector3d& point) {
  PointEquations equations;
  Eigen::Vector2d residual;
  Matrix23d jacobian;
  for (const PointObservation& seen : observations) {
    double chi2 = kUnseenChi2;
    if (reprojector.evaluate(seen.camera, seen.world_from_body, point, seen.pixel, seen.sigma,
                             residual, nullptr, &jacobian)) {
      chi2 = residual.squaredNorm();
      equations.hessian += jacobian.transpose() * jacobian;
      equations.gradient += jacobian.transpose() * residual;
    }
    equations.chi2 += chi2;
    equations.worst_chi2 = std::max(equations.worst_chi2, chi2);
  }
  return equations;
}

Eigen::Vector3d damped_step(const PointEquations& equations, const Damping& damping) {
  Eigen::Matrix3d damped = equations.hessian;
  for (int i = 0; i < 3; ++i) damped(i, i) += damping.of(damped(i, i));
  return damped.ldlt().solve(-equations.gradient);
}

bool determined(const Eigen::Matrix3d& hessian) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(hessian, Eigen::EigenvaluesOnly);
  const Eigen::Vector3d& values = solver.eigenvalues();
  return values[0] > kMinEigenvalueRatio * values[2];
}

}  // namespace

void PointRefinementOptions::check() const {
  require(iterations > 0, "point refinement: iterations must be positive, not {}", iterations);
}

PointEstimate refine_point(const Rig& rig, std::span<const PointObservation> observations,
                           const Eigen::Vector3d& initial, const PointRefinementOptions& options) {
  options.check();
  const Reprojector reprojector(rig);
  Damping damping;
  Eigen::Vector3d point = initial;
  PointEquations current = linearize(reprojector, observations, point);
  const PointEquations first = current;
  for (int i = 0; i < options.iterations && determined(current.hessian); ++i) {
    const Eigen::Vector3d step = damped_step(current, damping);
    const double predicted = -step.dot(current.gradient + 0.5 * current.hessian * step);
    const PointEquations next = linearize(reprojector, observations, point + step);
    if (next.chi2 <= current.chi2) {
      damping.accept(0.5 * (current.chi2 - next.chi2) / std::max(predicted, 1e-300));
      point += step;
      current = next;
    } else {
      damping.reject();
    }
    if (predicted < kNegligibleDecrease) break;
  }
  if (!determined(current.hessian))
    return {.point = initial, .chi2 = first.chi2, .worst_chi2 = first.worst_chi2};
  return {point, current.hessian.inverse(), current.chi2, current.worst_chi2, true};
}

}  // namespace rover
