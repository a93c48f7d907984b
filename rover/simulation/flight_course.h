#pragma once

#include <cstdint>

#include "rover/simulation/flight_volume.h"
#include "rover/simulation/spline_motion.h"

namespace rover {

// How a flight moves; see FlightStyle.
struct FlightManner {
  double speed = 0.7;        // m/s, mean
  double turn_rate = 0.7;    // rad/s, at most
  double wobble = 0.06;      // m: the to and fro that every flying or walking carrier adds
  double wobble_rate = 0.6;  // Hz
};

// What a flight along the path of a volume goes through: a lap and a tenth of a closed path, else
// its length. In m; 0 without a path.
double lap_length(const FlightVolume& volume);

// Where the body is and where the camera looks during `duration` s (x right, y down, z forward),
// in full motion from the first moment to the last, wobbling most in the first seconds. Positions
// keep `margin` m away from the limits of the volume.
SplineMotion fly_course(const FlightVolume& volume, const FlightManner& manner, double duration,
                        double margin, std::uint64_t seed);

}  // namespace rover
