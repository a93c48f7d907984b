#pragma once

#include <vector>

#include "rover/simulation/motion_fit.h"
#include "rover/simulation/spline_equations.h"

namespace rover {

// The least-squares problem of fit_motion(), in the world of the ground truth. All times are
// seconds of the motion, but for the clocks' offset.
class MotionFitProblem {
 public:
  struct Pose {
    double seconds;
    SE3 world_from_body;
  };
  struct Reading {
    double seconds;
    Eigen::Vector3d angular_velocity, acceleration;
  };
  // Residuals as vectors, in the order of the data.
  struct Residuals {
    std::vector<Eigen::Vector3d> position, rotation, gyroscope, accelerometer;
  };

  // The motion will last from 0 to `duration` s. Poses must cover that.
  MotionFitProblem(std::vector<Pose> poses, std::vector<Reading> readings, double duration,
                   double knot_interval, const MotionFitOptions& options);

  // Robust Gauss-Newton, twice: the second time with inertial data weighed by what the first left.
  // Throws InputError if the data do not determine a motion.
  void solve();

  const SplineMotion& motion() const { return motion_; }
  const std::vector<BiasNode>& biases() const { return biases_; }
  double time_offset() const { return time_offset_; }
  const Eigen::Vector3d& gravity() const { return gravity_; }
  Residuals residuals() const;

  // One residual with its derivatives.
  SplineResidual position_residual(const Pose& pose) const;
  SplineResidual rotation_residual(const Pose& pose) const;
  SplineResidual gyroscope_residual(const Reading& reading) const;
  SplineResidual accelerometer_residual(const Reading& reading) const;
  // Unknowns beside those of the control points: none without readings.
  int shared_count() const;
  // Moves all unknowns: six for each control point (position in the world; orientation, on the
  // right), then the shared ones.
  void step(const Eigen::VectorXd& delta);

 private:
  void add_bias(double seconds, bool gyroscope, SplineResidual& residual) const;
  void add_priors(SplineEquations& equations) const;
  // Adds all residuals and returns their robust cost.
  double build(SplineEquations& equations) const;
  void iterate();
  void weigh_readings();

  MotionFitOptions options_;
  std::vector<Pose> poses_;
  std::vector<Reading> readings_;
  SplineMotion motion_;
  std::vector<BiasNode> biases_;  // none without readings
  double time_offset_ = 0;
  Eigen::Vector3d gravity_;  // in the ground truth's world, m/s^2
};

// Root mean square of the vectors' lengths; 0 for none.
double root_mean_square(const std::vector<Eigen::Vector3d>& values);

// The bias at a time, linear between the nodes and constant outside; zero without nodes.
ImuBias bias_at(const std::vector<BiasNode>& nodes, double seconds);

}  // namespace rover
