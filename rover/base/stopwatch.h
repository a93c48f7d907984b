#pragma once

#include <chrono>

namespace rover {

// Measures how long things take, for reports only: no decision looks at a clock.
class Stopwatch {
 public:
  // ms since construction or the last lap.
  double lap_ms() {
    const auto now = std::chrono::steady_clock::now();
    const double passed = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return passed;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace rover
