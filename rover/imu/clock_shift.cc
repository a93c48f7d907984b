#include "rover/imu/clock_shift.h"

namespace rover {
namespace {

void add_shifted(std::span<const ImuSample> samples, Timestamp shift, ImuBuffer& buffer) {
  for (ImuSample sample : samples) {
    sample.time -= shift;
    buffer.add(sample);  // the end of one motion and the begin of the next are one
  }
}

// The buffer, with its ends held as far as from `begin` to `end`.
ImuBuffer reaching(const ImuBuffer& buffer, Timestamp begin, Timestamp end) {
  ImuBuffer result;
  ImuSample first = buffer.samples().front(), last = buffer.samples().back();
  if (first.time > begin) {
    first.time = begin;
    result.add(first);
  }
  for (const ImuSample& sample : buffer.samples()) result.add(sample);
  if (last.time < end) {
    last.time = end;
    result.add(last);
  }
  return result;
}

}  // namespace

ImuBuffer joined_samples(std::span<const Preintegration> motions, std::span<const ImuSample> after,
                         Timestamp shift) {
  ImuBuffer buffer;
  for (const Preintegration& motion : motions) add_shifted(motion.samples(), shift, buffer);
  for (const ImuSample& sample : after) {
    if (!motions.empty() && sample.time > motions.back().end())
      add_shifted({&sample, 1}, shift, buffer);
  }
  return buffer;
}

std::vector<Preintegration> with_shifted_clock(std::span<const Preintegration> motions,
                                               std::span<const ImuSample> after, Timestamp shift) {
  std::vector<Preintegration> result;
  if (motions.empty()) return result;
  const ImuBuffer buffer = reaching(joined_samples(motions, after, shift), motions.front().begin(),
                                    motions.back().end());
  for (const Preintegration& motion : motions)
    result.push_back(motion.over(buffer.between(motion.begin(), motion.end())));
  return result;
}

}  // namespace rover
