#pragma once

#include <optional>
#include <span>
#include <vector>

#include "rover/optimization/imu_factor.h"
#include "rover/optimization/pose_optimization.h"
#include "rover/optimization/reprojection.h"

namespace rover {

struct InertialPoseOptions {
  int rounds = 3;       // inliers are chosen anew after each; the first takes all
  int iterations = 8;   // per round, at most
  double chi2 = 5.991;  // as in PoseOptimizationOptions
  double huber = 2.447;

  void check() const;
};

// Two consecutive frames, as tracking knows them.
struct InertialPoseProblem {
  const Rig& rig;
  const Preintegration& motion;  // from the last frame to the current one
  InertialState last;
  // Information of `last` (inverse covariance, tangent of InertialState): the marginal that this
  // function returned for it. None: the last state is taken as exact, as after mapping has adjusted
  // it.
  std::optional<Matrix15d> last_information{};
  std::span<const PoseObservation> observations{};  // of the current frame
  std::optional<StatePrior> current_prior{};        // standing still, for one
  // How they err with the map (map_error.h), in its frame: the last state, as this function
  // returned it, and the landmarks around.
  Matrix15x3d last_response = Matrix15x3d::Zero();
  Matrix63d seen_response = Matrix63d::Zero();
  Eigen::Vector3d gravity = gravity_of_z_up();
};

struct InertialPoseEstimate {
  InertialState last;
  InertialState current;
  Matrix15d covariance = Matrix15d::Zero();    // of `current`, conditional on the map
  Matrix15d information = Matrix15d::Zero();   // its inverse: the prior for the next frame
  Matrix15x3d response = Matrix15x3d::Zero();  // how it errs with the map, in its frame
  std::vector<char> inliers;                   // per observation
  int inlier_count = 0;
  double mean_chi2 = 0;    // of the inliers' reprojection
  double imu_chi2 = 0;     // of the inertial residual, 9 degrees of freedom
  double prior_chi2 = 0;   // of the last state against what was known of it, 15 degrees
  bool converged = false;  // false: not finite or singular; states as given and as predicted
};

// Tracking with vision and inertia: minimises reprojection errors of fixed points in the current
// frame, the preintegrated motion from the last one, the walk of the bias and the prior of the last
// state, over both states; then the last state is marginalised (Schur complement), which leaves the
// prior for the next frame. With no observation the result is the prediction, its covariance grown:
// dead reckoning. The prior stays linearised where it was made (first-estimate Jacobians) since its
// mean moves by no more than rounding between frames; drop it when the map's epoch changes. Throws
// InputError for options that make no sense.
InertialPoseEstimate optimize_inertial_pose(const InertialPoseProblem& problem,
                                            const InertialPoseOptions& options);

}  // namespace rover
