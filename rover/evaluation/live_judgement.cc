#include "rover/evaluation/live_judgement.h"

#include <algorithm>

#include "rover/base/error.h"

namespace rover {
namespace {

constexpr double kReferenceGap = 0.1;  // s between poses of a ground truth worth interpolating

double seconds_of(const RunFolder& run, Timestamp time) {
  return seconds_between(run.offered.first, time);
}

std::vector<PosePair> between(const std::vector<PosePair>& pairs, Timestamp begin, Timestamp end) {
  std::vector<PosePair> inside;
  std::copy_if(pairs.begin(), pairs.end(), std::back_inserter(inside),
               [&](const PosePair& pair) { return pair.time >= begin && pair.time <= end; });
  return inside;
}

std::optional<ErrorStatistics> rigid_errors(const std::vector<PosePair>& pairs) {
  const auto alignment = align(pairs, AlignmentKind::kRigid);
  if (!alignment) return std::nullopt;
  return statistics_of(position_errors(move_estimates(*alignment, pairs)));
}

std::optional<ScaleError> scale_error(const RunFolder& run, const std::vector<PosePair>& pairs) {
  const auto alignment = align(pairs, AlignmentKind::kSimilarity);
  if (!alignment) return std::nullopt;
  return ScaleError{100 * (1 / alignment->scale - 1), seconds_of(run, pairs.front().time),
                    seconds_of(run, pairs.back().time)};
}

std::optional<ScaleError> early_scale(const RunFolder& run, const std::vector<PosePair>& pairs,
                                      const LiveOptions& options) {
  if (run.causal.empty()) return std::nullopt;
  const Timestamp begin = run.causal.front().time + from_seconds(options.scale_after);
  const auto window = between(pairs, begin, begin + from_seconds(options.scale_span));
  if (window.empty() ||
      seconds_between(window.front().time, window.back().time) < options.least_span) {
    return std::nullopt;
  }
  return scale_error(run, window);
}

std::optional<double> coverage_after(const RunFolder& run, Timestamp begin) {
  const auto since = [&](const auto& stamped) { return stamped.time >= begin; };
  const auto offered = std::count_if(run.frames.begin(), run.frames.end(), since);
  const auto placed = std::count_if(run.final.begin(), run.final.end(), since);
  if (offered == 0) return std::nullopt;
  return static_cast<double>(placed) / static_cast<double>(offered);
}

bool without_pose(const FrameLine& frame) {
  return frame.state == "lost" || frame.state == "waiting";
}

// Where a trajectory may step: at frames without a pose, and where epoch or map change if those
// count. In order of time.
std::vector<Timestamp> breaks_of(const RunFolder& run, bool announced) {
  std::vector<Timestamp> breaks;
  const FrameLine* last = nullptr;
  for (const FrameLine& frame : run.frames) {
    if (frame.state == "dropped" || frame.state == "skipped") continue;
    const bool changed = last && (frame.epoch != last->epoch || frame.map != last->map);
    if (without_pose(frame) || (announced && changed)) breaks.push_back(frame.time);
    last = &frame;
  }
  return breaks;
}

std::optional<LargestStep> largest_step(const RunFolder& run, const Trajectory& estimate,
                                        const Trajectory& reference,
                                        const std::vector<Timestamp>& breaks) {
  std::optional<LargestStep> largest;
  const auto pairs = pair_with_interpolated(estimate, reference, kReferenceGap);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    const auto next = std::upper_bound(breaks.begin(), breaks.end(), pairs[i - 1].time);
    if (next != breaks.end() && *next <= pairs[i].time) continue;
    const double metres = frame_to_frame_errors(std::span(pairs).subspan(i - 1, 2)).translation[0];
    if (!largest || metres > largest->metres) {
      largest = LargestStep{metres, seconds_of(run, pairs[i].time)};
    }
  }
  return largest;
}

// First and last frame of each stretch of neighbouring dead-reckoned ones.
using Stretches = std::vector<std::pair<std::size_t, std::size_t>>;
Stretches dead_reckoned(const std::vector<FrameLine>& frames) {
  Stretches stretches;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].state != "dead-reckoning") continue;
    if (stretches.empty() || stretches.back().second + 1 != i) stretches.emplace_back(i, i);
    stretches.back().second = i;
  }
  return stretches;
}

std::optional<double> drift_over(const std::vector<PosePair>& pairs, Timestamp begin,
                                 Timestamp end) {
  const auto first = std::lower_bound(pairs.begin(), pairs.end(), begin,
                                      [](const PosePair& p, Timestamp t) { return p.time < t; });
  const auto behind = std::upper_bound(pairs.begin(), pairs.end(), end,
                                       [](Timestamp t, const PosePair& p) { return t < p.time; });
  if (first == pairs.begin() || first == behind) return std::nullopt;
  const PosePair ends[] = {*(first - 1), *(behind - 1)};
  return frame_to_frame_errors(ends).translation[0];
}

std::vector<DeadReckoning> describe(const RunFolder& run, const Stretches& stretches,
                                    const std::vector<PosePair>& causal) {
  std::vector<DeadReckoning> gaps;
  for (const auto& [first, last] : stretches) {
    const Timestamp begin = run.frames[first].time, end = run.frames[last].time;
    gaps.push_back({seconds_of(run, begin), seconds_of(run, end), last - first + 1,
                    drift_over(causal, begin, end)});
  }
  return gaps;
}

std::optional<SplitErrors> split(const RunFolder& run, const Stretches& stretches,
                                 const std::vector<PosePair>& pairs) {
  std::vector<PosePair> inside, outside;
  for (const PosePair& pair : pairs) {
    const auto covers = [&](const auto& s) {
      return run.frames[s.first].time <= pair.time && pair.time <= run.frames[s.second].time;
    };
    const bool in = std::any_of(stretches.begin(), stretches.end(), covers);
    (in ? inside : outside).push_back(pair);
  }
  const auto alignment = align(outside, AlignmentKind::kRigid);
  if (inside.empty() || !alignment) return std::nullopt;
  const auto errors = [&](const std::vector<PosePair>& part) {
    return statistics_of(position_errors(move_estimates(*alignment, part)));
  };
  return SplitErrors{errors(inside), errors(outside)};
}

}  // namespace

void LiveOptions::check() const {
  require(from >= 0, "--from {}: must not be negative", from);
  require(scale_after >= 0 && least_span > 0 && scale_span >= least_span,
          "scale is judged from {} s on over {} to {} s: not a stretch of time", scale_after,
          least_span, scale_span);
  require(max_difference >= 0, "--max-difference must not be negative");
}

std::vector<PosePair> pair_with_interpolated(const Trajectory& estimate,
                                             const Trajectory& reference, double max_gap) {
  std::vector<PosePair> pairs;
  for (const StampedPose& stamped : estimate) {
    const auto after =
        std::lower_bound(reference.begin(), reference.end(), stamped.time,
                         [](const StampedPose& s, Timestamp t) { return s.time < t; });
    if (after == reference.end()) break;
    if (after->time == stamped.time) {
      pairs.push_back({stamped.time, stamped.pose, after->pose});
      continue;
    }
    if (after == reference.begin()) continue;
    const StampedPose &a = *(after - 1), &b = *after;
    const double gap = seconds_between(a.time, b.time);
    if (gap > max_gap) continue;
    const double share = seconds_between(a.time, stamped.time) / gap;
    const SE3 truth(a.pose.rotation.slerp(share, b.pose.rotation),
                    (1 - share) * a.pose.translation + share * b.pose.translation);
    pairs.push_back({stamped.time, stamped.pose, truth});
  }
  return pairs;
}

LiveJudgement judge_live(const RunFolder& run, const Trajectory& reference,
                         const LiveOptions& options) {
  options.check();
  LiveJudgement judgement;
  const auto causal = associate(run.causal, reference, options.max_difference);
  const auto final = associate(run.final, reference, options.max_difference);
  if (!run.causal.empty()) {
    judgement.initialised = seconds_of(run, run.causal.front().time);
    judgement.coverage = coverage_after(run, run.causal.front().time);
  }
  const Timestamp late = run.offered.first + from_seconds(options.from);
  judgement.late = rigid_errors(between(causal, late, run.offered.last));
  judgement.early_scale = early_scale(run, causal, options);
  judgement.final_scale = scale_error(run, final);
  judgement.causal_step = largest_step(run, run.causal, reference, breaks_of(run, true));
  judgement.odometry_step = largest_step(run, run.odometry, reference, breaks_of(run, false));
  const Stretches stretches = dead_reckoned(run.frames);
  judgement.gaps = describe(run, stretches, causal);
  judgement.causal_split = split(run, stretches, causal);
  judgement.final_split = split(run, stretches, final);
  return judgement;
}

}  // namespace rover
