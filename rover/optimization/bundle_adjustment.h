#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "rover/camera/camera.h"
#include "rover/geometry/se3.h"
#include "rover/optimization/reprojection.h"

namespace rover {

// A snapshot of (a part of) a map, as plain values; indices refer to the vectors below.
struct BundleObservation {
  int pose = -1;
  int point = -1;
  int camera = 0;         // of the rig, or kDisparity
  Eigen::Vector2d pixel;  // px, raw image
  double sigma = 1;       // px, standard deviation per axis
};

struct BundleProblem {
  Rig rig;
  std::vector<SE3> world_from_body;
  std::vector<char> pose_fixed;
  std::vector<Eigen::Vector3d> points;  // m, world frame
  std::vector<BundleObservation> observations;
};

enum class BundleSolver {
  kAutomatic,  // kSchur for windows of a map, kCeres for problems of very many poses
  kSchur,      // our own Levenberg-Marquardt with a dense reduced system, always one thread
  kCeres,
};

struct BundleOptions {
  int first_iterations = 5;    // with the robust kernel on all observations
  int second_iterations = 10;  // after outliers have been removed
  double chi2 = 5.991;
  double huber = 2.447;    // in sigmas
  bool fix_scale = false;  // mono: besides a fixed pose, hold the distance between the fixed
                           // pose and the farthest free one of the initial values; ignored
                           // where poses fixed in two places hold the scale already
  double min_relative_decrease = 1e-6;  // of the cost in one iteration: below, a pass ends
  BundleSolver solver = BundleSolver::kAutomatic;
  int threads = 1;                      // of kCeres: more than one is not reproducible
  std::function<bool()> should_stop{};  // asked after each iteration; empty: never

  void check() const;
};

struct BundleSummary {
  std::vector<char> inliers;  // per observation, at the end
  double initial_cost = 0;    // robust cost 0.5 sum rho of all observations, outliers included
  double final_cost = 0;
  int iterations = 0;
  bool usable = false;  // false: the problem was empty or not finite, or the solver failed;
                        // nothing changed
};

// Minimises the robust reprojection error over all free poses and points (Levenberg-Marquardt with
// Schur elimination of the points: Triggs et al. 2000; one thread: reproducible), in two passes
// with removal of outliers between. Poses and points are updated in place; those that nothing
// observes stay where they are. At least one pose must be fixed. Throws InputError for options that
// make no sense, std::invalid_argument for indices out of range or no fixed pose.
BundleSummary adjust_bundle(BundleProblem& problem, const BundleOptions& options);

}  // namespace rover
