#pragma once

#include <vector>

#include "rover/datasets/trajectory.h"
#include "rover/simulation/imu_synthesis.h"
#include "rover/simulation/spline_motion.h"

namespace rover {

struct MotionFitOptions {
  double start = 0;     // s after the first pose of the ground truth
  double duration = 0;  // s; 0: to the last pose
  // Poses of the ground truth farther apart than this (s) are a gap: refused or, with `cut`, the
  // longest stretch without gaps is taken.
  double max_gap = 0.2;
  bool cut = false;
  // Of the spline, s: motion up to about a third of its inverse is followed; what shakes faster is
  // vibration of the airframe and left to the residuals. Without inertial data it is raised to what
  // the poses can tell.
  double knot_interval = 0.05;
  double gravity = kGravity;  // m/s^2
  // Deviations on each axis that weigh the residuals. Poses of a motion capture err slowly, so they
  // count less than their scatter suggests. Those of the inertial data are vibration rather than
  // the sensor's noise: these are upper bounds, lowered to what a first fit leaves.
  double position_sigma = 0.005;     // m
  double rotation_sigma = 0.01;      // rad
  double gyroscope_sigma = 0.1;      // rad/s
  double accelerometer_sigma = 1.5;  // m/s^2
  // Biases are linear between nodes so far apart (s), and walk from node to node.
  double bias_interval = 10;
  int max_iterations = 20;

  // Throws InputError for values that make no sense.
  void check() const;
};

// Root mean squares of what a fit leaves, each a vector's length. Slow: below 5 Hz; worst: of the
// slow ones, those of the worst 5 s. Where ground truth and inertial data contradict each other,
// the worst tell.
struct MotionFitResiduals {
  double position = 0;             // m, of the ground truth
  double rotation = 0;             // rad
  double gyroscope = 0;            // rad/s; zero, like the rest, without inertial data
  double accelerometer = 0;        // m/s^2
  double slow_gyroscope = 0;       // rad/s
  double slow_accelerometer = 0;   // m/s^2
  double worst_gyroscope = 0;      // rad/s
  double worst_accelerometer = 0;  // m/s^2

  // Whether ground truth and inertial data are of two different motions somewhere: an estimator
  // that is fed images along the one and the other has no right answer. What fits is at .005 rad/s
  // and .15 m/s^2 in the worst 5 s of 40 s of flight, what does not at .5 m/s^2.
  bool contradicts() const { return worst_gyroscope > 0.01 || worst_accelerometer > 0.25; }
};

// The biases at one time of the motion.
struct BiasNode {
  double seconds = 0;
  ImuBias bias;
};

struct FittedMotion {
  SplineMotion motion;           // begins at 0; the world's z axis points up
  Timestamp origin = 0;          // seconds 0 of the motion, on the inertial sensor's clock (without
                                 // inertial data: the ground truth's)
  double time_offset = 0;        // s to add to stamps of the ground truth to get to that clock
  double tilt = 0;               // rad by which the ground truth's z axis missed the vertical
  std::vector<BiasNode> biases;  // of the inertial data, linear in between; empty without
  MotionFitResiduals residuals;
};

// The smooth motion behind a real flight: a spline fitted by robust least squares to its ground
// truth (poses of the inertial sensor) and, unless `imu` is empty, to its inertial data at once,
// with the clocks' offset, the tilt of gravity and the biases as unknowns. Images rendered along it
// and inertial data, synthetic or real, then agree.
//
// Throws InputError for a ground truth of less than two seconds, with gaps, or whose times do not
// lie within those of the inertial data.
FittedMotion fit_motion(const Trajectory& ground_truth, const std::vector<ImuSample>& imu,
                        const MotionFitOptions& options = {});

// The real inertial data of a fitted flight from its motion's begin() to its end(), moved in time
// so that seconds 0 of the motion is at `epoch`. With the biases of the fit.
ImuRecording real_imu(const FittedMotion& fit, const std::vector<ImuSample>& imu, Timestamp epoch);

}  // namespace rover
