#pragma once

#include <string>
#include <vector>

#include "rover/optimization/imu_factor.h"

namespace rover {

struct CalibrationOptions {
  bool time_offset = false;  // what is estimated; the rest is taken as it stands
  bool extrinsics = false;
  // How well the calibration given is known beforehand, per axis.
  double prior_time_offset = 0.02;  // s
  double prior_rotation = 0.0175;   // rad
  double prior_translation = 0.02;  // m
  // Accepted below these, posterior standard deviations. The translation needs none: it shows
  // weakly in most motions, and where it does not its prior holds it.
  double max_time_sigma = 0.002;      // s
  double max_rotation_sigma = 0.005;  // rad, per axis
  double max_chi2_ratio = 10;  // per degree of freedom: more means that camera and inertial sensor
                               // contradict each other in other ways
  double gyroscope_bias_sigma = 0.1;      // rad/s: what the bias is known to beforehand
  double accelerometer_bias_sigma = 0.2;  // m/s^2
  double huber = 4.11;                    // of a motion's 9 residuals: the root of their 95% point
  int iterations = 30;

  bool enabled() const { return time_offset || extrinsics; }
  int unknowns() const { return (time_offset ? 1 : 0) + (extrinsics ? 6 : 0); }
  void check() const;
};

// How far the inertial sensor's clock and its place are from where they are taken to be.
struct CameraImuCalibration {
  double time_offset = 0;  // s: stamp of an inertial reading = time on the camera's clock + offset
  SE3 body_from_camera;    // of camera 0; the others of a rig move with it
};

// Keyframes in order of time, as vision alone has found them, in a world that is about metric.
struct CalibrationProblem {
  std::vector<SE3> world_from_camera;
  // What vision knows of the poses of all cameras but the first, in their tangents; the scale need
  // not be among it.
  Eigen::MatrixXd information;
  std::vector<Preintegration> motions;    // of each keyframe to the next one
  std::vector<ImuSample> after;           // readings that follow the last motion, if there are any
  std::vector<Eigen::Vector3d> velocity;  // of the body, m/s, world: a start
  ImuBias bias;                           // likewise
  Eigen::Vector3d gravity = gravity_of_z_up();  // likewise
  CameraImuCalibration now;    // a start: what holds for the motions' stamps as they are
  CameraImuCalibration given;  // the prior's mean
};

struct CalibrationResult {
  bool solved = false;  // else only `missing` says something
  CameraImuCalibration calibration{};
  double time_sigma = 0;                                        // s; 0 where not estimated
  Eigen::Vector3d rotation_sigma = Eigen::Vector3d::Zero();     // rad, about the camera's axes
  Eigen::Vector3d translation_sigma = Eigen::Vector3d::Zero();  // m, along the camera's axes
  double chi2_ratio = 0;  // (weighted) chi-square per degree of freedom
  double chi2_gain = 0;   // by how much chi-square is better than with the calibration as it was,
                          // measured in chi2_ratio where that is above 1
  bool accepted = false;  // certain enough, as the options say
  bool significant = false;  // accepted, and better than before beyond chance (about 99%)
  std::string missing{};     // if not accepted: what to do, in plain words
};

// The body's tangent (translation, rotation) by the camera's, for a camera that is fixed to it; by
// a change of body_from_camera it is the opposite.
Matrix6d body_by_camera(const SE3& body_from_camera);

// Maximum-a-posteriori estimation of the clock's offset and of the rig's place in the body,
// together with the cameras' poses (which vision holds), velocities, gravity's direction and one
// bias. A state is the body's at the camera's moment; the inertial data tell of it as it was (or
// will be) the offset earlier: position, rotation and velocity are carried there with the readings
// at hand, so the offset enters nothing but inertial factors, and motions are cut anew at the
// offset found until it stays. Motions that do not fit lose weight; standard deviations are scaled
// up by the square root of chi2_ratio where that is above 1. Throws InputError for options that
// make no sense, std::invalid_argument where sizes do not fit.
CalibrationResult calibrate_camera_imu(const CalibrationProblem& problem,
                                       const CalibrationOptions& options);

}  // namespace rover
