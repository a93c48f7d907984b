#include "rover/optimization/pose_residuals.h"

#include <algorithm>

namespace rover {

bool PoseResiduals::select(const SE3& pose) {
  const BodyFrame frame(pose);
  bool changed = false;
  for (std::size_t i = 0; i < observations_.size(); ++i) {
    const PoseObservation& seen = observations_[i];
    const double squared =
        reprojector_.chi2(seen.camera, frame.from_world(seen.point), seen.pixel, seen.sigma);
    const char fits = squared <= chi2_;
    changed |= fits != selected_[i];
    selected_[i] = fits;
  }
  return changed;
}

PoseEquations PoseResiduals::linearize(const SE3& pose) const {
  const BodyFrame frame(pose);
  PoseEquations equations;
  for (std::size_t i = 0; i < observations_.size(); ++i) {
    if (selected_[i]) add(frame, observations_[i], equations);
  }
  return equations;
}

int PoseResiduals::selected_count() const {
  return static_cast<int>(std::count(selected_.begin(), selected_.end(), 1));
}

void PoseResiduals::add(const BodyFrame& frame, const PoseObservation& seen,
                        PoseEquations& equations) const {
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

}  // namespace rover
