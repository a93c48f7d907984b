#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "rover/evaluation/metrics.h"
#include "rover/evaluation/run_folder.h"

namespace rover {

struct LiveOptions {
  double from = 20;             // s after the first frame offered: the late error begins
  double scale_after = 15;      // s after the first causal pose: where scale is judged from
  double scale_span = 10;       // s: over how long
  double least_span = 5;        // s: less than that says nothing of scale
  double max_difference = .02;  // s between poses that belong together

  // Throws InputError for values that make no sense.
  void check() const;
};

// How much larger an estimate is than the truth, in %; seconds count from the first frame offered.
struct ScaleError {
  double percent = 0;
  double begin = 0, end = 0;
};

// The largest error of the motion between two neighbouring frames.
struct LargestStep {
  double metres = 0;
  double time = 0;  // s after the first frame offered, of the later frame
};

// Neighbouring frames placed by inertial data alone. Seconds count from the first frame offered.
struct DeadReckoning {
  double begin = 0, end = 0;
  std::size_t frames = 0;
  std::optional<double> drift;  // m, of the motion from the last frame before to the last one in it
};

// Errors within and outside dead reckoning, both after the SE(3) alignment of what lies outside.
struct SplitErrors {
  ErrorStatistics inside, outside;
};

// What matters to those who use a pose when it comes, in metric modes. Nothing where the run does
// not say.
struct LiveJudgement {
  std::optional<double> initialised;      // s after the first frame offered: the first causal pose
  std::optional<double> coverage;         // final poses / frames offered, both from then on
  std::optional<ErrorStatistics> late;    // ATE SE(3) of the causal poses from LiveOptions::from on
  std::optional<ScaleError> early_scale;  // of the causal poses some time after the first one
  std::optional<ScaleError> final_scale;  // of the final trajectory
  std::optional<LargestStep> causal_step;    // announced epochs, other maps and losses left out
  std::optional<LargestStep> odometry_step;  // losses left out
  std::vector<DeadReckoning> gaps;
  std::optional<SplitErrors> causal_split, final_split;  // where there are gaps
};

// Throws InputError for options that make no sense.
LiveJudgement judge_live(const RunFolder& run, const Trajectory& reference,
                         const LiveOptions& options);

nlohmann::ordered_json to_json(const LiveJudgement& judgement, const LiveOptions& options);

// For people: a heading, and a row for each figure that there is.
std::vector<std::vector<std::string>> live_rows(const LiveJudgement& judgement,
                                                const LiveOptions& options);

// Each pose with the reference's, interpolated, where that has poses within max_gap s around.
std::vector<PosePair> pair_with_interpolated(const Trajectory& estimate,
                                             const Trajectory& reference, double max_gap);

}  // namespace rover
