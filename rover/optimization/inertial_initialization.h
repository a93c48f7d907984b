#pragma once

#include <string>
#include <vector>

#include "rover/geometry/sim3.h"
#include "rover/optimization/imu_factor.h"

namespace rover {

struct InitializationOptions {
  int iterations = 50;
  double huber = 4.11;                    // of a motion's 9 residuals: the root of their 95% point
  double gyroscope_bias_sigma = 0.1;      // rad/s: what biases are known to beforehand
  double accelerometer_bias_sigma = 0.2;  // m/s^2
  double max_scale_sigma = 0.05;          // relative: accepted below
  double max_gravity_sigma = 0.03;        // rad: likewise, per axis
  double max_chi2_ratio = 10;             // chi-square per degree of freedom: more means that
                                          // camera and inertial sensor contradict each other
  // Below these, a lack of information is put down to them.
  double min_duration = 2;        // s
  double min_rotation = 0.2;      // rad between any keyframe and the first
  double min_acceleration = 0.5;  // m/s^2 rms about the mean

  void check() const;
};

// Keyframes of a visual map, in order of time.
struct InitializationProblem {
  std::vector<SE3> world_from_camera;   // any orientation; in mono up to scale
  SE3 body_from_camera;                 // of that camera, metres
  std::vector<Preintegration> motions;  // of each keyframe to the next one
  bool metric = false;                  // the scale is right already (stereo)
};

struct InitializationResult {
  bool solved = false;      // else only `missing` says something
  Sim3 aligned_from_world;  // turns z up and makes metric; about the world's origin, yaw kept
  std::vector<InertialState> states;  // of each keyframe, in the aligned world
  double scale_sigma = 0;    // relative, posterior standard deviation; 0 in a metric problem
  double gravity_sigma = 0;  // rad, of the direction, the worse of both axes
  Vector6d bias_sigma = Vector6d::Zero();
  std::vector<double> chi2;  // per motion, 9 degrees of freedom
  double chi2_ratio = 0;     // (weighted) chi-square per degree of freedom of all
  bool accepted = false;     // certain enough, as the options say
  std::string missing;       // if not accepted: what to do, in plain words
};

// Inertial-only maximum-a-posteriori estimation: Campos, Montiel, Tardós, "Inertial-only
// optimization for visual-inertial initialization" (2020). Keyframe poses are taken from vision up
// to scale; scale, gravity's direction, one bias and the velocities are found from a linear start
// and refined with Levenberg and Marquardt's method; motions that do not fit lose weight (poses
// that vision got wrong). Standard deviations are scaled up by the square root of chi2_ratio where
// that is above 1: errors of the visual poses are in it. Also refines an aligned map later: its
// result is then close to the identity. Throws InputError for options that make no sense,
// std::invalid_argument where sizes do not fit.
InitializationResult initialize_inertial(const InitializationProblem& problem,
                                         const InitializationOptions& options);

}  // namespace rover
