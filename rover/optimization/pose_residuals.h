#pragma once

#include <span>
#include <vector>

#include "rover/optimization/pose_optimization.h"
#include "rover/optimization/reprojection.h"
#include "rover/optimization/robust_kernel.h"

namespace rover {

// The normal equations of one pose.
struct PoseEquations {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0;
  double chi2 = 0;  // sum of the squared residuals
};

// The observations of known points from one pose, and which of them are believed. Keeps references.
class PoseResiduals {
 public:
  PoseResiduals(const Rig& rig, std::span<const PoseObservation> observations, double chi2,
                double huber)
      : observations_(observations),
        chi2_(chi2),
        reprojector_(rig),
        kernel_{huber},
        selected_(observations.size(), 1) {}

  // Selects the observations that fit the pose; whether that changed the selection.
  bool select(const SE3& pose);

  // Of the selected observations.
  PoseEquations linearize(const SE3& pose) const;

  const std::vector<char>& selected() const { return selected_; }
  int selected_count() const;

 private:
  void add(const BodyFrame& frame, const PoseObservation& seen, PoseEquations& equations) const;

  std::span<const PoseObservation> observations_;
  double chi2_;
  Reprojector reprojector_;
  HuberKernel kernel_;
  std::vector<char> selected_;
};

}  // namespace rover
