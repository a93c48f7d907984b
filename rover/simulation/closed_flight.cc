#include "rover/simulation/closed_flight.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rover/base/error.h"

namespace rover {
namespace {

constexpr double kLongestReturn = 10;  // s from the end of a lap to the begin of the next
constexpr double kShortestLap = 10;    // s

double smooth_step(double x) { return x * x * x * (10 + x * (6 * x - 15)); }

double heading_of(const Eigen::Quaterniond& rotation) {
  return 2 * std::atan2(rotation.z(), rotation.w());
}

Eigen::Quaterniond turned(double heading) { return so3_exp({0, 0, heading}); }

// Heading and tilt apart: the shortest way between two attitudes may lead over head. `turn` is that
// from heading to heading of the neighbour before, so that it goes on the same way round.
Eigen::Quaterniond blend(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b, double share,
                         double& turn) {
  const double heading = heading_of(a);
  turn += std::remainder(heading_of(b) - heading - turn, 2 * std::numbers::pi);
  const Eigen::Quaterniond tilt_a = turned(-heading) * a, tilt_b = turned(-heading - turn) * b;
  return (turned(heading + share * turn) * tilt_a.slerp(share, tilt_b)).normalized();
}

// The last control points of a lap lead over to those before its first one.
std::vector<SE3> closed_lap(const std::vector<SE3>& control, std::size_t lap, std::size_t back,
                            const Eigen::Quaterniond& body_from_camera) {
  std::vector<SE3> closed(control.begin() + static_cast<std::ptrdiff_t>(back),
                          control.begin() + static_cast<std::ptrdiff_t>(back + lap));
  double turn = 0;
  for (std::size_t i = 0; i < back; ++i) {
    SE3& end = closed[lap - back + i];
    const SE3& start = control[i];
    const double share = smooth_step(static_cast<double>(i) / static_cast<double>(back));
    end.translation = (1 - share) * end.translation + share * start.translation;
    // The camera looks about level, so its heading is certain; that of the body need not be.
    const Eigen::Quaterniond camera =
        blend(end.rotation * body_from_camera, start.rotation * body_from_camera, share, turn);
    end.rotation = (camera * body_from_camera.conjugate()).normalized();
  }
  return closed;
}

}  // namespace

SplineMotion make_closed_flight(const FlightVolume& volume, const FlightOptions& options,
                                int laps) {
  require(laps >= 1, "flight: {} laps; it takes one or more", laps);
  require(volume.path.empty(), "flight: laps are flown in a room or hall, not along a path");
  require(options.duration >= kShortestLap, "flight: a lap takes {} s or more", kShortestLap);
  FlightOptions opened = options;
  opened.duration += std::min(kLongestReturn, 0.5 * options.duration);
  const SplineMotion flight = make_flight(volume, opened);
  const double step = flight.knot_interval();
  const auto lap = static_cast<std::size_t>(std::lround(options.duration / step));
  const auto back =
      static_cast<std::size_t>(std::lround((opened.duration - options.duration) / step));
  const std::vector<SE3> once =
      closed_lap(flight.control(), lap, back, options.body_from_camera.rotation);
  std::vector<SE3> control;
  for (std::size_t i = 0; i < lap * static_cast<std::size_t>(laps) + kSplineOrder - 1; ++i) {
    control.push_back(once[i % lap]);
  }
  return {0, step, std::move(control)};
}

}  // namespace rover
