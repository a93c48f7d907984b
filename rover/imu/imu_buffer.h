#pragma once

#include <deque>
#include <vector>

#include "rover/imu/imu_sample.h"

namespace rover {

// The line between two samples, read at a time between (or near) theirs.
ImuSample interpolate(const ImuSample& a, const ImuSample& b, Timestamp time);

// Inertial samples on their way from the sensor to preintegration, in order of time.
class ImuBuffer {
 public:
  // Takes a sample; false, leaving it out, if it is not finite or not later than the last one.
  bool add(const ImuSample& sample);

  // Whether the samples reach from `from` to `to`. The first or last one may stand for up to 20 ms
  // beyond it: images rarely wait for the next sample.
  bool covers(Timestamp from, Timestamp to) const;

  // The samples from `from` to `to`, both ends interpolated. At least two, or none where the
  // samples do not cover the interval.
  std::vector<ImuSample> between(Timestamp from, Timestamp to) const;

  // Drops what between() with a later `from` does not need.
  void forget_before(Timestamp time);

  // Moves the stamps of all samples.
  void shift(Timestamp by);

  bool empty() const { return samples_.empty(); }
  const std::deque<ImuSample>& samples() const { return samples_; }
  int refused() const { return refused_; }  // samples left out so far

 private:
  ImuSample at(Timestamp time) const;

  std::deque<ImuSample> samples_;
  int refused_ = 0;
};

}  // namespace rover
