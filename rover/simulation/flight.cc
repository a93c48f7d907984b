#include "rover/simulation/flight.h"

#include <algorithm>
#include <cmath>

#include "rover/base/error.h"
#include "rover/simulation/flight_course.h"
#include "rover/simulation/polyline.h"
#include "rover/simulation/wander.h"

namespace rover {
namespace {

constexpr double kStep = 0.02;         // s between control points: a hand shakes at up to 8 Hz
constexpr double kRest = 0.3;          // s at the start
constexpr double kRamp = 1.0;          // s to full speed, and down to none
constexpr double kShakeReach = 0.01;   // m to each side
constexpr double kShakeAngle = 0.05;   // rad
constexpr double kSmallestRoom = 0.1;  // m
constexpr std::uint64_t kShake = 4;    // what random numbers are for

FlightManner manner_of(FlightStyle style) {
  if (style == FlightStyle::kAggressive) return {2, 2.1, 0.1, 0.9};
  return {0.7, 0.7, 0.06, 0.6};
}

// From 0 at 0 to 1 at 1 with two continuous derivatives.
double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10 + x * (6 * x - 15));
}

// How fast the flight goes on at a time, as a share of full speed.
double pace(const FlightOptions& options, double time) {
  const double start = smooth_step((time - kRest) / kRamp);
  if (options.style != FlightStyle::kHover) return start;
  const double to_stop = std::abs(time - 0.5 * options.duration) - 0.5 * options.still;
  return start * smooth_step(to_stop / kRamp);
}

// The course's own clock at each control point.
std::vector<double> course_times(const FlightOptions& options) {
  std::vector<double> times = {0};
  const int count = static_cast<int>(std::ceil(options.duration / kStep - 1e-6)) + kSplineOrder - 1;
  for (int i = 1; i < count; ++i) {
    times.push_back(times.back() + kStep * pace(options, (i - 2.5) * kStep));
  }
  return times;
}

void shake(const FlightOptions& options, std::vector<SE3>& control) {
  Random random(hash_seed(options.seed, kShake));
  const Wander3 sway(3, 8, random), turn(3, 8, random);
  for (std::size_t i = 0; i < control.size(); ++i) {
    const double time = (static_cast<double>(i) - 2) * kStep;
    const double strength = pace(options, time);
    control[i].translation += strength * kShakeReach * sway(time);
    control[i].rotation =
        (control[i].rotation * so3_exp(strength * kShakeAngle * turn(time))).normalized();
  }
}

void check_path(const FlightVolume& volume) {
  require(volume.path.size() >= 2 && lap_length(volume) >= 1,
          "flight: the path is shorter than 1 m");
  require(volume.path_radius >= kSmallestRoom, "flight: the path is narrower than 10 cm");
  for (const Eigen::Vector3d& point : volume.path) {
    require(
        (point.array() >= volume.min.array()).all() && (point.array() <= volume.max.array()).all(),
        "flight: the path leaves the box");
  }
}

void check_volume(const FlightVolume& volume) {
  require((volume.max - volume.min).minCoeff() >= kSmallestRoom,
          "flight: the box is narrower than 10 cm");
  if (!volume.path.empty()) check_path(volume);
}

}  // namespace

FlightStyle parse_flight_style(const std::string& name) {
  if (name == "smooth") return FlightStyle::kSmooth;
  if (name == "aggressive") return FlightStyle::kAggressive;
  if (name == "shaking") return FlightStyle::kShaking;
  if (name == "hover") return FlightStyle::kHover;
  throw InputError("motion '{}' is not known; choose smooth, aggressive, shaking or hover", name);
}

void FlightOptions::check() const {
  require(duration >= 1 && duration <= 3600, "flight: the duration must lie between 1 s and 1 h");
  require(style != FlightStyle::kHover || (still >= 0 && still + 4 * kRamp <= duration),
          "flight: standing still for {} s takes a duration of {} s or more", still,
          still + 4 * kRamp);
}

SplineMotion make_flight(const FlightVolume& volume, const FlightOptions& options) {
  options.check();
  check_volume(volume);
  const bool shaken = options.style == FlightStyle::kShaking;
  const std::vector<double> times = course_times(options);
  const SplineMotion course = fly_course(volume, manner_of(options.style), times.back() + kStep,
                                         shaken ? kShakeReach : 0, options.seed);
  const Eigen::Quaterniond camera_from_body = options.body_from_camera.rotation.conjugate();
  std::vector<SE3> control;
  for (const double time : times) {
    const SE3 aim = course.pose_at(time);
    control.emplace_back((aim.rotation * camera_from_body).normalized(), aim.translation);
  }
  if (shaken) shake(options, control);
  return {0, kStep, std::move(control)};
}

double lap_duration(const FlightVolume& volume, FlightStyle style) {
  if (volume.path.empty()) return 0;
  return kRest + 0.5 * kRamp + lap_length(volume) / manner_of(style).speed;
}

}  // namespace rover
