#pragma once

#include "rover/simulation/flight.h"

namespace rover {

// A flight in a box that comes back to where it began, as fast and the same way turned, and goes
// round and round: laps of `options.duration` s, rounded to 20 ms. It is in full motion from the
// first moment on. So one lap's images serve for all.
//
// Throws InputError for volumes with a path, laps shorter than 10 s and what make_flight refuses.
SplineMotion make_closed_flight(const FlightVolume& volume, const FlightOptions& options, int laps);

}  // namespace rover
