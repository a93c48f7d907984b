#pragma once

#include <vector>

#include <Eigen/Core>

#include "rover/optimization/bundle_pass.h"
#include "rover/optimization/reprojection.h"
#include "rover/optimization/robust_kernel.h"

namespace rover {

// The unknowns of a bundle adjustment.
struct BundleState {
  std::vector<SE3> world_from_body;
  std::vector<Eigen::Vector3d> points;  // m, world
};

// All observations of one point from one pose (both cameras of a stereo rig: one block).
struct BundleEdge {
  int pose = -1;
  int slot = -1;  // of the pose among the free ones; -1: fixed
  int begin = 0;  // of its observations in BundleStructure::observations
  int end = 0;
};

// The observed points and which edges are theirs.
struct BundleTrack {
  int point = -1;
  int begin = 0;  // of its edges in BundleStructure::edges
  int end = 0;
};

// Who sees what, in the order of the sweep: by point, then by pose, then as given. Sorted by a
// counting sort, in linear time.
struct BundleStructure {
  BundleStructure(const BundleProblem& problem, const std::vector<char>& active);

  std::vector<BundleObservation> observations;
  std::vector<BundleEdge> edges;
  std::vector<BundleTrack> tracks;
  std::vector<int> free_poses;  // slot -> pose
  int longest_track = 0;        // in edges
};

// The normal equations of one linearisation, in blocks: H d = -g.
struct BundleEquations {
  double cost = 0;                              // 0.5 sum rho
  std::vector<Matrix6d> pose_hessian;           // per slot
  std::vector<Vector6d> pose_gradient;          // per slot
  std::vector<Eigen::Matrix3d> point_hessian;   // per track
  std::vector<Eigen::Vector3d> point_gradient;  // per track
  std::vector<Matrix63d> cross;                 // per edge: pose by point; unset where fixed
};

// Builds the normal equations of the reprojection error at given states.
class BundleLinearizer {
 public:
  BundleLinearizer(const BundleProblem& problem, const BundleStructure& structure,
                   const BundlePass& pass);

  // Fills `equations`, whose memory is used again.
  void linearize(const BundleState& state, BundleEquations& equations) const;

 private:
  void reset(BundleEquations& equations) const;
  PointInformation gather(const BundleEdge& edge, const Eigen::Vector3d& point_in_body,
                          double& cost) const;
  void hold_scale(const BundleState& state, BundleEquations& equations) const;

  const BundleStructure& structure_;
  const ScaleGauge& gauge_;
  Reprojector reprojector_;
  HuberKernel kernel_;
};

}  // namespace rover
