#pragma once

#include "rover/imu/imu_sample.h"

namespace rover {

// How much noisier than its data sheet the inertial sensor is taken to be. The defaults hold on the
// EuRoC flights with the densities of their sensor.yaml (docs/inertial.md has the figures): the
// vibration of the airframe passes for noise here, and what changes with attitude (errors of scale
// and alignment, and of the poses it is compared with) for a bias that walks.
struct ImuNoiseOptions {
  double gyroscope_inflation = 8;
  double accelerometer_inflation = 10;
  double gyroscope_walk_inflation = 1;
  double accelerometer_walk_inflation = 30;
  // A step between samples longer than this is a gap: the motion in it is a guess (the line
  // between its ends) with the standard deviations below.
  double gap = 0.025;                 // s
  double gap_angular_velocity = 0.5;  // rad/s
  double gap_acceleration = 2;        // m/s^2

  void check() const;
};

// The noise that preintegration reckons with, continuous time.
struct ImuNoise {
  double gyroscope = 0;           // rad/s/sqrt(Hz)
  double accelerometer = 0;       // m/s^2/sqrt(Hz)
  double gyroscope_walk = 0;      // rad/s^2/sqrt(Hz)
  double accelerometer_walk = 0;  // m/s^3/sqrt(Hz)
  double gap = 0;                 // as in the options
  double gap_angular_velocity = 0;
  double gap_acceleration = 0;

  // Throws InputError for a calibration or options that make no sense.
  static ImuNoise of(const ImuCalibration& calibration, const ImuNoiseOptions& options);

  // Variances of the mean readings over a step of dt seconds, (rad/s)^2 and (m/s^2)^2.
  double gyroscope_variance(double dt) const {
    return dt > gap ? gap_angular_velocity * gap_angular_velocity : gyroscope * gyroscope / dt;
  }
  double accelerometer_variance(double dt) const {
    return dt > gap ? gap_acceleration * gap_acceleration : accelerometer * accelerometer / dt;
  }
};

}  // namespace rover
