#include "rover/diagnosis/inertial_check.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "rover/diagnosis/axis_fit.h"
#include "rover/imu/imu_check.h"
#include "rover/imu/inertial_state.h"
#include "rover/optimization/camera_imu_alignment.h"

namespace rover {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kMaxOffset = 0.5;         // s that clocks may be apart and be told so
constexpr double kDoubtfulOffset = 0.005;  // s
constexpr double kDoubtfulRotation = 2;    // degrees
constexpr double kLittleMotion = 0.05;     // rad/s
constexpr double kRelated = 0.7;           // correlation below which motions are not the same
constexpr double kSwapMargin = 0.05;       // by which other axes must correlate better
constexpr double kSwapResidual = 0.4;      // m/s^2 by which other axes must fit better

void add_rate(const ImuReport& report, Topic& topic) {
  const Severity severity = report.rate < 50    ? Severity::kWarning
                            : report.rate < 100 ? Severity::kNote
                                                : Severity::kOk;
  topic.add(severity, "imu_rate",
            fmt::format("{} samples over {:.1f} s, {:.1f} per second", report.samples,
                        report.duration, report.rate),
            "100 Hz or more are wanted: motion between samples is lost", report.rate);
}

void add_rest(const ImuReport& report, const ImuCalibration& calibration, Topic& topic) {
  if (!report.rest) {
    topic.ok("rest",
             "the sensor is never at rest: noise cannot be compared with the calibration's");
    return;
  }
  const ImuRest& rest = *report.rest;
  topic.ok(
      "rest_noise",
      fmt::format("at rest (from {} s on) the noise is {:.2g} rad/s/sqrt(Hz) and {:.2g} "
                  "m/s^2/sqrt(Hz), {:.1f} and {:.1f} times what is configured",
                  format_seconds(rest.begin), rest.gyroscope_density, rest.accelerometer_density,
                  rest.gyroscope_density / calibration.gyroscope_noise,
                  rest.accelerometer_density / calibration.accelerometer_noise));
  topic.add(judge_above(rest.gyroscope.norm(), 0.15, 0.5), "rest_gyroscope",
            fmt::format("at rest the gyroscope reads {} rad/s: its bias",
                        format_vector(rest.gyroscope, 4)),
            "that is much for a bias: take it off, or look at the unit", rest.gyroscope.norm());
  topic.add(judge_above(std::abs(rest.gravity - kGravity), 0.3, 0.6), "rest_gravity",
            fmt::format("at rest the accelerometer reads {:.3f} m/s^2", rest.gravity),
            "9.81 is expected: look at its unit and calibration", rest.gravity);
}

ImuBuffer buffer_of(std::span<const ImuSample> samples) {
  ImuBuffer buffer;
  for (const ImuSample& sample : samples) buffer.add(sample);
  return buffer;
}

std::string unit_advice(double scale) {
  if (std::abs(scale * kDegrees - 1) < 0.2) return "they look like deg/s: convert to rad/s";
  return "look at the gyroscope's unit and range, and at the camera's focal length";
}

// Other axes leave less than half as much unexplained. The difference in correlation alone says
// little: one lively axis that is right may hide two others.
bool is_swapped(const GyroscopeFit& fit) {
  const auto unexplained = [](double correlation) { return 1 - correlation * correlation; };
  return fit.correlation > 0.9 && fit.correlation > fit.as_given + kSwapMargin &&
         (fit.as_given < 0 || 4 * unexplained(fit.correlation) < unexplained(fit.as_given));
}
bool is_scaled(const GyroscopeFit& fit) { return std::abs(std::log(fit.scale)) > 0.15; }

// False where nothing more can be said of the pair of sensors.
bool judge_motion(const std::optional<GyroscopeFit>& fit, Topic& topic) {
  if (!fit || fit->motion < kLittleMotion) {
    topic.add(Severity::kNote, "rotation_correlation",
              "the camera turns too little, or was not tracked for long enough, to compare it with "
              "the gyroscope",
              "record some seconds of turning about all axes in front of texture");
    return false;
  }
  const bool related = fit->any_orientation > kRelated;
  topic.add(related ? Severity::kOk : Severity::kWarning, "rotation_correlation",
            fmt::format("camera and gyroscope turn alike: correlation {:.3f}{}",
                        fit->any_orientation, related ? "" : ", far too little"),
            "clocks are more than half a second apart, or the files are of different recordings",
            fit->any_orientation);
  return related;
}

void judge_gyroscope(const GyroscopeFit& fit, Topic& topic) {
  if (is_scaled(fit))
    topic.add(Severity::kWarning, "gyroscope_scale",
              fmt::format("the camera turns {:.3g} times as fast as the gyroscope says", fit.scale),
              unit_advice(fit.scale), fit.scale);
  if (is_swapped(fit))
    topic.add(
        Severity::kWarning, "gyroscope_axes",
        fmt::format("the gyroscope's axes are mixed up: its readings fit as {} (correlation "
                    "{:.3f}, as they are {:.3f})",
                    describe_axes(fit.axes), fit.correlation, fit.as_given),
        fit.axes.determinant() < 0
            ? "this mirrors the axes: no extrinsics can mend it, change the driver"
            : "change the readings, or the rotation of T_BS if the accelerometer fits so too");
  if (!is_scaled(fit) && !is_swapped(fit))
    topic.ok("gyroscope_axes",
             fmt::format("the gyroscope's axes and unit are right: correlation {:.3f}, scale "
                         "{:.3f} as they are",
                         fit.as_given, fit.scale),
             fit.as_given);
}

void judge_accelerometer(const AccelerometerFit& fit, Topic& topic) {
  const bool swapped =
      fit.as_given > 2 * fit.residual && fit.as_given > fit.residual + kSwapResidual;
  if (swapped)
    topic.add(Severity::kWarning, "accelerometer_axes",
              fmt::format("the accelerometer's axes are mixed up: its readings fit as {} ({:.2f} "
                          "m/s^2 off the visual motion, as they are {:.2f})",
                          describe_axes(fit.axes), fit.residual, fit.as_given),
              "change the readings, or the rotation of T_BS if the gyroscope fits so too",
              fit.as_given);
  else
    topic.ok("accelerometer_axes",
             fmt::format("the accelerometer's axes are right as far as the motion tells: {:.2f} "
                         "m/s^2 off the visual motion",
                         fit.as_given),
             fit.as_given);
}

void judge_offset(const CameraImuAlignment& found, double offset, Topic& topic) {
  const double size = std::abs(offset);
  const bool off = size > kDoubtfulOffset && size > 3 * found.time_sigma;
  const bool known = found.time_sigma < kDoubtfulOffset;
  topic.add(off     ? Severity::kWarning
            : known ? Severity::kOk
                    : Severity::kNote,
            "time_offset",
            fmt::format("inertial time = image time {} {:.1f} ms (standard deviation {:.1f} ms)",
                        offset < 0 ? "-" : "+", 1e3 * size, 1e3 * found.time_sigma),
            off ? "correct the stamps by it: image stamps are to be mid-exposure"
                : "livelier turning would tell it better",
            offset);
}

void judge_extrinsics(const CameraImuAlignment& found, const Eigen::Quaterniond& body_from_camera,
                      Topic& topic) {
  const Eigen::Vector3d turn =
      kDegrees * so3_log(body_from_camera.conjugate() * found.body_from_camera);
  const double sigma = kDegrees * found.rotation_sigma, size = turn.norm();
  const bool off = size > kDoubtfulRotation && size > 3 * sigma;
  topic.add(off                         ? Severity::kWarning
            : sigma < kDoubtfulRotation ? Severity::kOk
                                        : Severity::kNote,
            "extrinsic_rotation",
            fmt::format("the camera is turned by {:.2f} degrees against its calibration, {} about "
                        "its axes (standard deviation {:.2f})",
                        size, format_vector(turn, 2), sigma),
            off ? "calibrate camera and inertial sensor anew; body_from_camera is wrong by that"
                : "turning about more axes would tell it better",
            size);
}

// The same samples with the gyroscope put right, so that what else is wrong can be told.
std::vector<ImuSample> mended(std::span<const ImuSample> samples, const GyroscopeFit& fit) {
  std::vector<ImuSample> result(samples.begin(), samples.end());
  for (ImuSample& sample : result) {
    if (is_swapped(fit)) sample.angular_velocity = fit.axes * sample.angular_velocity;
    if (is_scaled(fit)) sample.angular_velocity *= fit.scale;
  }
  return result;
}

Trajectory shifted(Trajectory trajectory, double offset) {
  for (StampedPose& pose : trajectory) pose.time += from_seconds(offset);
  return trajectory;
}

void judge_alignment(const Trajectory& camera, const Eigen::Quaterniond& body_from_camera,
                     const ImuBuffer& imu, double coarse_offset, Topic& topic) {
  std::vector<StampedRotation> rotations;
  for (const StampedPose& pose : camera) rotations.push_back({pose.time, pose.pose.rotation});
  CameraImuAlignmentOptions options;
  options.max_offset = 0.02;  // around the coarse one
  const auto found = align_camera_to_imu(rotations, imu, options);
  if (!found) {
    topic.add(Severity::kNote, "time_offset",
              "the motion does not determine clocks and extrinsics: it turns about one axis only",
              "record some seconds of turning about all axes");
    return;
  }
  judge_offset(*found, coarse_offset + found->time_offset, topic);
  judge_extrinsics(*found, body_from_camera, topic);
}

}  // namespace

void check_inertial_data(std::span<const ImuSample> samples, const ImuCalibration& calibration,
                         Findings& findings) {
  Topic topic("imu", findings);
  const ImuReport report = check_imu(samples, &calibration, {});
  if (report.rate > 0) add_rate(report, topic);
  for (const std::string& warning : report.warnings)
    topic.add(Severity::kWarning, "imu_data", warning, "see docs/inertial.md for what is expected");
  if (report.rate > 0) add_rest(report, calibration, topic);
}

void check_camera_against_imu(const Trajectory& camera, const Eigen::Quaterniond& body_from_camera,
                              std::span<const ImuSample> samples, Findings& findings) {
  Topic topic("camera and imu", findings);
  const auto fit = fit_gyroscope(camera, body_from_camera, buffer_of(samples), kMaxOffset);
  if (!judge_motion(fit, topic)) return;
  judge_gyroscope(*fit, topic);
  const ImuBuffer imu = buffer_of(mended(samples, *fit));
  const Trajectory together = shifted(camera, fit->time_offset);
  if (const auto force = fit_accelerometer(together, body_from_camera, imu))
    judge_accelerometer(*force, topic);
  judge_alignment(together, body_from_camera, imu, fit->time_offset, topic);
}

}  // namespace rover
