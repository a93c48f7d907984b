#pragma once

#include <optional>
#include <vector>

#include "rover/optimization/bundle_adjustment.h"
#include "rover/optimization/imu_factor.h"

namespace rover {

// Inertial data between two keyframes that follow each other in time.
struct InertialLink {
  int from = -1;  // poses of the bundle
  int to = -1;
  Preintegration motion;
};

struct PlacedPrior {
  int pose = -1;
  StatePrior prior;
};

// A bundle adjustment of states: poses with velocities and biases. A fixed pose is a fixed state,
// but for the border's, of which velocity and biases are free. A pose without a link (the covisible
// keyframes outside a window) has no use for the rest of its state.
struct InertialBundleProblem {
  BundleProblem bundle;                   // world gravity-aligned, metric
  std::vector<Eigen::Vector3d> velocity;  // per pose, m/s, world
  std::vector<ImuBias> bias;              // per pose
  std::vector<InertialLink> links;
  std::vector<PlacedPrior> priors;  // what is known of biases; standing still; ...
  int border = -1;                  // the fixed pose that the links begin at; or none
  Eigen::Vector3d gravity = gravity_of_z_up();

  InertialState state(int pose) const {
    return {bundle.world_from_body[pose], velocity[pose], bias[pose]};
  }
};

struct InertialBundleOptions {
  BundleOptions bundle{};    // passes, outliers, kernel; solver, threads and fix_scale are not used
  bool covariance = false;   // of all free states: cubic in their number
  bool scale_sigma = false;  // for the price of an iteration
  int covariance_of = -1;    // of one free state alone: about as much as two iterations

  void check() const;
};

struct InertialBundleSummary {
  BundleSummary visual;               // `usable` and the iterations are those of the whole;
                                      // the costs are of the reprojection alone
  std::vector<double> link_chi2;      // per link, 9 degrees of freedom, at the end
  std::vector<Matrix15d> covariance;  // per pose, zero where fixed; empty unless asked for and
                                      // everything is observed
  std::optional<Matrix15d> state_covariance;         // of the one state asked for, likewise
  Matrix15x3d state_response = Matrix15x3d::Zero();  // how it errs, in the frame of the map, with
                                                     // the map's error (map_error.h), where poses
                                                     // are fixed
  std::vector<Vector15d> with_scale;  // per pose, of all free states: the covariance with the
                                      // logarithm of the scale; where no pose is fixed
  std::vector<Matrix6d> seen;         // per pose, zero where fixed: what observations would tell of
                                      // it, were their points known
  double scale_sigma = 0;  // relative, of the scale that the positions of all poses give;
                           // zero unless asked for and observed
};

// Visual-inertial adjustment: robust reprojection errors in all cameras, inertial links with the
// random walk of the biases, and priors, over poses, velocities, biases and points. Points are
// eliminated, the states are solved densely; two passes as in adjust_bundle; one thread,
// reproducible. Preintegration is repeated before each pass where biases have moved far. With no
// fixed pose the four free degrees of freedom (position, rotation about gravity) are held at the
// first pose. Throws InputError for options that make no sense, std::invalid_argument for indices
// out of range or sizes that differ.
InertialBundleSummary adjust_inertial_bundle(InertialBundleProblem& problem,
                                             const InertialBundleOptions& options);

}  // namespace rover
