#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Core>

#include "rover/base/random.h"

namespace rover {

// A smooth random function of time with values in [-1, 1], mostly within +-0.7: the mean of four
// sines with random phases, whose frequencies (Hz) are spread over a band.
class Wander {
 public:
  Wander(double low, double high, Random& random) {
    for (std::size_t i = 0; i < sines_.size(); ++i) {
      const double place = (static_cast<double>(i) + random.uniform()) / kSines;
      sines_[i] = {2 * std::numbers::pi * low * std::pow(high / low, place),
                   random.uniform(0, 2 * std::numbers::pi)};
    }
  }
  double operator()(double time) const {
    double sum = 0;
    for (const Sine& sine : sines_) sum += std::sin(sine.rate * time + sine.phase);
    return sum / kSines;
  }

 private:
  static constexpr int kSines = 4;
  struct Sine {
    double rate, phase;  // rad/s, rad
  };
  std::array<Sine, kSines> sines_;
};

// One for each axis.
class Wander3 {
 public:
  Wander3(double low, double high, Random& random)
      : axes_{Wander(low, high, random), Wander(low, high, random), Wander(low, high, random)} {}
  Eigen::Vector3d operator()(double time) const {
    return {axes_[0](time), axes_[1](time), axes_[2](time)};
  }

 private:
  std::array<Wander, 3> axes_;
};

}  // namespace rover
