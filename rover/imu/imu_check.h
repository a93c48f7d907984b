#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rover/imu/imu_sample.h"

namespace rover {

struct ImuCheckOptions {
  double gap = 0.025;                // s between samples that are called a gap, and at least 3
                                     // times the usual step
  double rest_window = 0.5;          // s
  double rest_gyroscope = 0.02;      // rad/s: where readings scatter less, over a window, the
  double rest_accelerometer = 0.15;  // m/s^2: body is taken to be at rest

  void check() const;
};

// What the quietest stretch says, where the body is at rest.
struct ImuRest {
  Timestamp begin = 0;
  double gravity = 0;                                   // m/s^2, length of the mean reading
  Eigen::Vector3d gyroscope = Eigen::Vector3d::Zero();  // mean: the bias, rad/s
  double gyroscope_density = 0;                         // noise seen, rad/s/sqrt(Hz)
  double accelerometer_density = 0;                     // m/s^2/sqrt(Hz)
};

// Inertial data looked over before use.
struct ImuReport {
  int samples = 0;
  double rate = 0;       // Hz, of the usual step
  double duration = 0;   // s
  int not_finite = 0;    // samples with NaN or infinity
  int out_of_order = 0;  // samples not later than the one before
  int gaps = 0;
  double longest_gap = 0;            // s
  double median_acceleration = 0;    // m/s^2
  double high_angular_velocity = 0;  // rad/s: 95% are below
  std::optional<ImuRest> rest;
  std::vector<std::string> warnings;  // in plain words, each with what to do
};

// Looks samples over as they came from the sensor. `calibration`, if given, is compared with the
// noise at rest and the rate.
ImuReport check_imu(std::span<const ImuSample> samples, const ImuCalibration* calibration,
                    const ImuCheckOptions& options);

}  // namespace rover
