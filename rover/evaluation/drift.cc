#include "rover/evaluation/drift.h"

#include <algorithm>

namespace rover {
namespace {

constexpr double kLeastSeconds = 10;
constexpr double kLeastShare = 0.3;
// Stamps of an estimate and of its reference differ by a little.
constexpr Timestamp kSlack = kNanosecondsPerSecond / 2;

double length_of(const Trajectory& trajectory) {
  double length = 0;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    length += (trajectory[i].pose.translation - trajectory[i - 1].pose.translation).norm();
  }
  return length;
}

}  // namespace

std::optional<BlindStretch> find_blind_stretch(const Trajectory& reference, Timestamp first,
                                               Timestamp last) {
  BlindStretch longest;
  for (std::size_t i = 1; i < reference.size(); ++i) {
    const Timestamp begin = reference[i - 1].time, end = reference[i].time;
    if (begin < first - kSlack || end > last + kSlack) continue;
    if (end - begin > longest.end - longest.begin) longest = {begin, end};
  }
  const double seconds = seconds_between(longest.begin, longest.end);
  if (seconds < kLeastSeconds || seconds < kLeastShare * seconds_between(first, last)) return {};
  return longest;
}

std::optional<Drift> measure_drift(const Trajectory& estimate, std::span<const PosePair> pairs,
                                   const BlindStretch& stretch, AlignmentKind kind) {
  const auto behind = std::partition_point(pairs.begin(), pairs.end(), [&](const PosePair& pair) {
    return pair.time < stretch.begin + (stretch.end - stretch.begin) / 2;
  });
  const auto count = static_cast<std::size_t>(behind - pairs.begin());
  const auto alignment = align(pairs.first(count), kind);
  if (!alignment || behind == pairs.end()) return std::nullopt;
  Drift drift;
  drift.blind = seconds_between(stretch.begin, stretch.end);
  drift.path = alignment->scale * length_of(estimate);
  drift.position = statistics_of(position_errors(move_estimates(*alignment, pairs.subspan(count))));
  drift.percent = drift.path > 0 ? 100 * drift.position.rmse / drift.path : 0;
  return drift;
}

}  // namespace rover
