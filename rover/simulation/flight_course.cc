#include "rover/simulation/flight_course.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "rover/simulation/polyline.h"
#include "rover/simulation/wander.h"

namespace rover {
namespace {

constexpr double kStep = 0.02;           // s between control points
constexpr double kHurry = 1.5;           // times the mean speed, to get round in the time given
constexpr double kLookAhead = 1.5;       // m
constexpr double kDownwards = 0.08;      // rad below the horizon
constexpr double kStartStrength = 2.5;   // times the wobble at the start
constexpr double kStartTime = 5;         // s
constexpr double kSharpestWander = 0.3;  // Hz at 1 m/s: a tiny box is not flown through in no time

// What the random numbers are for.
enum Purpose : std::uint64_t { kPlace = 1, kView = 2, kWobble = 3 };

// A place to be and a horizontal direction to look in, at one time.
struct Aim {
  Eigen::Vector3d position;
  double heading;  // rad from the x axis, in (-pi, pi]
};
using Aims = std::function<Aim(double)>;

double heading_of(const Eigen::Vector3d& direction) {
  return std::atan2(direction.y(), direction.x());
}

Eigen::Vector3d horizontal(double heading) { return {std::cos(heading), std::sin(heading), 0}; }

// Turns to and fro, at most by about the rate of the manner.
Wander turning(const FlightManner& manner, double amplitude, Random& random) {
  const double rate = manner.turn_rate / (2 * std::numbers::pi * amplitude);
  return {0.5 * rate, 1.5 * rate, random};
}

// --- in a box -----------------------------------------------------------------------------------

double mean_speed(const Wander3& wander, const Eigen::Vector3d& amplitude) {
  constexpr int kSteps = 4000;
  constexpr double kUnit = 0.02;
  double length = 0;
  for (int i = 0; i < kSteps; ++i) {
    length += amplitude.cwiseProduct(wander((i + 1) * kUnit) - wander(i * kUnit)).norm();
  }
  return length / (kSteps * kUnit);
}

// Wanders through the box and looks at a point that wanders around it, outside.
Aims aims_in_box(const FlightVolume& volume, const FlightManner& manner,
                 const Eigen::Vector3d& reach, std::uint64_t seed) {
  Random place(hash_seed(seed, kPlace)), view(hash_seed(seed, kView));
  const Eigen::Vector3d center = 0.5 * (volume.min + volume.max);
  const Wander3 wander(0.6, 1.6, place);
  const double clock =
      std::min(manner.speed / mean_speed(wander, reach), kSharpestWander * manner.speed);
  const double distance = 2.2 * reach.head<2>().maxCoeff() + 0.5;
  constexpr double kSweep = 1.2;  // rad
  const Wander sweep = turning(manner, kSweep, view);
  const double start = view.uniform(-std::numbers::pi, std::numbers::pi);
  const double drift = (view.uniform() < 0.5 ? -0.15 : 0.15) * manner.turn_rate;
  return [=](double time) -> Aim {
    const Eigen::Vector3d position = center + reach.cwiseProduct(wander(clock * time));
    const double direction = start + drift * time + kSweep * sweep(time);
    return {position, heading_of(center + distance * horizontal(direction) - position)};
  };
}

// --- along a path -------------------------------------------------------------------------------

Polyline path_of(const FlightVolume& volume) { return {volume.path, volume.closed}; }

// Where to be on a line, and which way to go there.
struct Progress {
  double distance;
  double sign;
};

// Open lines are flown to and fro.
Progress progress_on(const Polyline& path, double distance) {
  if (path.closed()) return {distance, 1};
  const double lap = std::fmod(distance, 2 * path.length());
  return lap <= path.length() ? Progress{lap, 1} : Progress{2 * path.length() - lap, -1};
}

double speed_along(const FlightVolume& volume, const FlightManner& manner, double duration) {
  return std::clamp(lap_length(volume) / duration, manner.speed, kHurry * manner.speed);
}

Aims aims_along_path(const FlightVolume& volume, const FlightManner& manner,
                     const Eigen::Vector3d& reach, double speed, std::uint64_t seed) {
  Random place(hash_seed(seed, kPlace)), view(hash_seed(seed, kView));
  const Polyline path = path_of(volume);
  const Wander3 stray(0.05 * speed, 0.15 * speed, place);
  constexpr double kSweep = 0.5;  // rad
  const Wander sweep = turning(manner, kSweep, view);
  return [=](double time) -> Aim {
    const auto [distance, sign] = progress_on(path, speed * time);
    const Eigen::Vector3d here = path.at(distance);
    const Eigen::Vector3d ahead = path.at(distance + sign * kLookAhead);
    return {here + reach.cwiseProduct(stray(time)),
            heading_of(ahead - here) + kSweep * sweep(time)};
  };
}

// --- smoothing ----------------------------------------------------------------------------------

template <class T>
std::vector<T> smooth(const std::vector<T>& values, double sigma) {
  const int reach = static_cast<int>(std::ceil(3 * sigma / kStep));
  const int last = static_cast<int>(values.size()) - 1;
  std::vector<double> weights;
  double total = 0;
  for (int k = -reach; k <= reach; ++k) {
    weights.push_back(std::exp(-0.5 * std::pow(k * kStep / sigma, 2)));
    total += weights.back();
  }
  std::vector<T> smoothed;
  for (int i = 0; i <= last; ++i) {
    T sum = weights[reach] / total * values[i];
    for (int k = 1; k <= reach; ++k) {
      sum +=
          weights[reach + k] / total * (values[std::max(i - k, 0)] + values[std::min(i + k, last)]);
    }
    smoothed.push_back(sum);
  }
  return smoothed;
}

// Follows headings no faster than `rate` rad/s; the result does not wrap around.
std::vector<double> follow(const std::vector<double>& headings, double rate) {
  std::vector<double> followed = {headings.front()};
  for (std::size_t i = 1; i < headings.size(); ++i) {
    const double miss = std::remainder(headings[i] - followed.back(), 2 * std::numbers::pi);
    followed.push_back(followed.back() + std::clamp(miss, -rate * kStep, rate * kStep));
  }
  return followed;
}

// --- the whole ----------------------------------------------------------------------------------

// How far positions may stray on each axis, from the box's centre or from the path.
Eigen::Vector3d reach_of(const FlightVolume& volume, double margin) {
  if (volume.path.empty()) {
    return 0.5 * (volume.max - volume.min) - Eigen::Vector3d::Constant(margin);
  }
  // Corners are cut by at most a fifth of the radius; the rest is shared by three axes.
  Eigen::Vector3d reach = Eigen::Vector3d::Constant(0.45 * volume.path_radius);
  for (const Eigen::Vector3d& point : volume.path) {
    reach = reach.cwiseMin(point - volume.min).cwiseMin(volume.max - point);
  }
  return (reach - Eigen::Vector3d::Constant(margin)).cwiseMax(0);
}

// By how many seconds positions are smoothed (standard deviation): corners of a path are cut by at
// most 0.8 times the way gone meanwhile. In a box there are none.
double smoothing_of(const FlightVolume& volume, double speed) {
  constexpr double kLongest = 0.4;  // s
  return volume.path.empty() ? 0 : std::min(kLongest, 0.25 * volume.path_radius / speed);
}

Eigen::Quaterniond look(double heading, double pitch, double roll) {
  Eigen::Matrix3d level;  // world from camera for heading 0
  level << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return so3_exp({0, 0, heading}) * so3_exp({0, -pitch, 0}) * so3_exp({roll, 0, 0}) *
         Eigen::Quaterniond(level);
}

// The aims at all control points, made flyable.
struct Course {
  std::vector<Eigen::Vector3d> positions;
  std::vector<double> headings;
};
Course smooth_course(const Aims& aims, int count, double smoothing, const FlightManner& manner) {
  Course course;
  for (int i = 0; i < count; ++i) {
    const Aim aim = aims(std::max(0.0, (i - 2) * kStep));
    course.positions.push_back(aim.position);
    course.headings.push_back(aim.heading);
  }
  if (smoothing > 0) course.positions = smooth(course.positions, smoothing);
  course.headings = smooth(follow(course.headings, 0.7 * manner.turn_rate), 0.3);
  return course;
}

// The control points of a course, swaying by up to `wobble` m on each axis and turning with it,
// more in the first seconds.
std::vector<SE3> wobbled(const Course& course, const FlightManner& manner,
                         const Eigen::Vector3d& wobble, std::uint64_t seed) {
  Random random(hash_seed(seed, kWobble));
  const Wander3 sway(0.5 * manner.wobble_rate, 1.5 * manner.wobble_rate, random);
  const Wander3 nod(0.3 * manner.wobble_rate, manner.wobble_rate, random);
  const double nodding = 0.05 * manner.turn_rate / manner.wobble_rate;  // rad: 0.2 turn rates
  std::vector<SE3> control;
  for (std::size_t i = 0; i < course.positions.size(); ++i) {
    const double time = (static_cast<double>(i) - 2) * kStep;
    const double strength = 1 + (kStartStrength - 1) * std::exp(-std::pow(time / kStartTime, 2));
    const Eigen::Vector3d turn = strength * nodding * nod(time);
    control.emplace_back(look(course.headings[i] + turn.x(), turn.y() - kDownwards, 0.7 * turn.z()),
                         course.positions[i] + strength * wobble.cwiseProduct(sway(time)));
  }
  return control;
}

}  // namespace

double lap_length(const FlightVolume& volume) {
  if (volume.path.empty()) return 0;
  return (volume.closed ? 1.1 : 1.0) * path_of(volume).length();
}

SplineMotion fly_course(const FlightVolume& volume, const FlightManner& manner, double duration,
                        double margin, std::uint64_t seed) {
  const bool along = !volume.path.empty();
  const double speed = along ? speed_along(volume, manner, duration) : manner.speed;
  const Eigen::Vector3d room = reach_of(volume, margin);
  const Eigen::Vector3d wobble = (0.4 / kStartStrength * room).cwiseMin(manner.wobble);
  const Eigen::Vector3d reach = room - kStartStrength * wobble;
  const Aims aims = along ? aims_along_path(volume, manner, reach, speed, seed)
                          : aims_in_box(volume, manner, reach, seed);
  const int count = static_cast<int>(std::ceil(duration / kStep)) + kSplineOrder - 1;
  const Course course = smooth_course(aims, count, smoothing_of(volume, speed), manner);
  return {0, kStep, wobbled(course, manner, wobble, seed)};
}

}  // namespace rover
