#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace rover {

// A point in time of the sensors' clock, in nanoseconds. Image stamps are mid-exposure. Stamps are
// parsed and printed as decimals and never pass through a double, which cannot hold them.
using Timestamp = std::int64_t;

constexpr Timestamp kNanosecondsPerSecond = 1'000'000'000;

// Reads "1305031102.175304", "12" or "1.037359e-01" as seconds, to the nanosecond. Nothing if the
// text is not a number or does not fit.
std::optional<Timestamp> parse_seconds(std::string_view text);

// Reads an integer number of nanoseconds.
std::optional<Timestamp> parse_nanoseconds(std::string_view text);

// "1305031102.175304000": seconds with nine decimals.
std::string format_seconds(Timestamp time);

// The difference of two stamps, small enough for a double, in seconds.
inline double seconds_between(Timestamp from, Timestamp to) {
  return static_cast<double>(to - from) * 1e-9;
}

inline Timestamp from_seconds(double seconds) {
  return static_cast<Timestamp>(seconds * 1e9 + (seconds < 0 ? -0.5 : 0.5));
}

}  // namespace rover
