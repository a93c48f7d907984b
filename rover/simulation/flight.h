#pragma once

#include <cstdint>
#include <string>

#include "rover/simulation/flight_volume.h"
#include "rover/simulation/spline_motion.h"

namespace rover {

enum class FlightStyle {
  kSmooth,      // about 0.7 m/s, turns of up to 40 deg/s
  kAggressive,  // about 2 m/s, turns of up to 120 deg/s
  kShaking,     // smooth, held by a hand that shakes at 3 to 8 Hz by some degrees and up to 2 cm
  kHover,       // smooth, with a stop in mid-flight
};

// "smooth", "aggressive", "shaking", "hover". Throws InputError for others.
FlightStyle parse_flight_style(const std::string& name);

struct FlightOptions {
  double duration = 20;  // s, rounded up to 20 ms
  FlightStyle style = FlightStyle::kSmooth;
  double still = 3;  // s that kHover stands still in the middle
  // The camera whose optical axis (+z) is steered: inwards in a box, forward along a path.
  SE3 body_from_camera;
  std::uint64_t seed = 0;

  // Throws InputError for values that make no sense.
  void check() const;
};

// A random flight of the body through a volume, the same for the same seed. It starts at rest and
// is moved about in the first seconds, as visual-inertial initialisation wants it. In a box it
// wanders through all of it, coming back to where it was; along a path it flies there (and back, or
// round and round where the path is closed). The duration decides how far it gets: see
// lap_duration(). The body's origin stays in the volume.
//
// Throws InputError for volumes without room: a box with less than 10 cm along an axis, a path with
// fewer than two points, shorter than 1 m, narrower than 10 cm or leaving the box.
SplineMotion make_flight(const FlightVolume& volume, const FlightOptions& options);

// How many seconds a flight of this style takes for one lap of a closed path and a tenth of the
// next one, so that the start is seen again; the way to the end of an open path; 0 in a box.
double lap_duration(const FlightVolume& volume, FlightStyle style);

}  // namespace rover
