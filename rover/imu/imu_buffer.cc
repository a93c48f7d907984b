#include "rover/imu/imu_buffer.h"

#include <algorithm>
#include <iterator>

namespace rover {
namespace {

constexpr Timestamp kHold = 20'000'000;  // ns that an end of the buffer may stand for beyond itself

bool before(const ImuSample& sample, Timestamp time) { return sample.time < time; }

}  // namespace

ImuSample interpolate(const ImuSample& a, const ImuSample& b, Timestamp time) {
  const double share =
      b.time > a.time ? seconds_between(a.time, time) / seconds_between(a.time, b.time) : 0;
  return {time, a.angular_velocity + share * (b.angular_velocity - a.angular_velocity),
          a.acceleration + share * (b.acceleration - a.acceleration)};
}

bool ImuBuffer::add(const ImuSample& sample) {
  const bool good = sample.angular_velocity.allFinite() && sample.acceleration.allFinite() &&
                    (samples_.empty() || sample.time > samples_.back().time);
  if (good) {
    samples_.push_back(sample);
  } else {
    ++refused_;
  }
  return good;
}

bool ImuBuffer::covers(Timestamp from, Timestamp to) const {
  return !samples_.empty() && from < to && samples_.front().time <= from + kHold &&
         samples_.back().time >= to - kHold && samples_.front().time < to &&
         samples_.back().time > from;
}

ImuSample ImuBuffer::at(Timestamp time) const {
  const auto next = std::lower_bound(samples_.begin(), samples_.end(), time, before);
  const ImuSample& b = next == samples_.end() ? samples_.back() : *next;
  const ImuSample& a = next == samples_.begin() ? samples_.front() : *std::prev(next);
  if (&a == &b || time >= samples_.back().time) return {time, b.angular_velocity, b.acceleration};
  return interpolate(a, b, time);
}

std::vector<ImuSample> ImuBuffer::between(Timestamp from, Timestamp to) const {
  if (!covers(from, to)) return {};
  std::vector<ImuSample> result = {at(from)};
  auto next = std::lower_bound(samples_.begin(), samples_.end(), from + 1, before);
  for (; next != samples_.end() && next->time < to; ++next) result.push_back(*next);
  result.push_back(at(to));
  return result;
}

void ImuBuffer::shift(Timestamp by) {
  for (ImuSample& sample : samples_) sample.time += by;
}

void ImuBuffer::forget_before(Timestamp time) {
  while (samples_.size() > 1 && samples_[1].time <= time) samples_.pop_front();
}

}  // namespace rover
