// What is said of a LiveJudgement.

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "rover/evaluation/live_judgement.h"

namespace rover {
namespace {

using Json = nlohmann::ordered_json;
using TableRows = std::vector<std::vector<std::string>>;

Json statistics_json(const ErrorStatistics& s) {
  return {{"rmse", s.rmse}, {"median", s.median}, {"max", s.max}, {"poses", s.count}};
}

Json scale_json(const ScaleError& scale) {
  return {{"percent", scale.percent}, {"begin_s", scale.begin}, {"end_s", scale.end}};
}

Json step_json(const LargestStep& step) { return {{"m", step.metres}, {"at_s", step.time}}; }

Json split_json(const SplitErrors& split) {
  return {{"inside_m", statistics_json(split.inside)},
          {"outside_m", statistics_json(split.outside)}};
}

Json gap_json(const DeadReckoning& gap) {
  return {{"begin_s", gap.begin},
          {"end_s", gap.end},
          {"frames", gap.frames},
          {"drift_m", gap.drift ? Json(*gap.drift) : Json()}};
}

template <class Value, class Format>
void add(TableRows& rows, const std::string& label, const std::optional<Value>& value,
         const Format& format) {
  if (value) rows.push_back({label, format(*value)});
}

std::string scale_text(const ScaleError& scale) {
  return fmt::format("{:+.2f} (of {:.1f} to {:.1f} s)", scale.percent, scale.begin, scale.end);
}

std::string step_text(const LargestStep& step) {
  return fmt::format("{:.1f} (at {:.2f} s)", 1000 * step.metres, step.time);
}

std::string split_text(const SplitErrors& split) {
  return fmt::format("{:.4f} (max {:.4f}); outside {:.4f}", split.inside.rmse, split.inside.max,
                     split.outside.rmse);
}

std::string gap_text(const DeadReckoning& gap) {
  return gap.drift ? fmt::format("drift {:.4f} m", *gap.drift) : std::string("drift unknown");
}

}  // namespace

Json to_json(const LiveJudgement& judgement, const LiveOptions& options) {
  Json json = {{"late_from_s", options.from}};
  if (judgement.initialised) json["initialised_s"] = *judgement.initialised;
  if (judgement.coverage) json["coverage"] = *judgement.coverage;
  if (judgement.late) json["late_ate_m"] = statistics_json(*judgement.late);
  if (judgement.early_scale) json["early_scale"] = scale_json(*judgement.early_scale);
  if (judgement.final_scale) json["final_scale"] = scale_json(*judgement.final_scale);
  if (judgement.causal_step) json["causal_step"] = step_json(*judgement.causal_step);
  if (judgement.odometry_step) json["odometry_step"] = step_json(*judgement.odometry_step);
  json["dead_reckoning"] = Json::array();
  for (const DeadReckoning& gap : judgement.gaps) {
    json["dead_reckoning"].push_back(gap_json(gap));
  }
  if (judgement.causal_split) json["causal_gaps"] = split_json(*judgement.causal_split);
  if (judgement.final_split) json["final_gaps"] = split_json(*judgement.final_split);
  return json;
}

TableRows live_rows(const LiveJudgement& judgement, const LiveOptions& options) {
  TableRows rows = {{"live", ""}};
  add(rows, "first pose after [s]", judgement.initialised,
      [](double s) { return fmt::format("{:.2f}", s); });
  add(rows, "coverage from then on [%]", judgement.coverage,
      [](double share) { return fmt::format("{:.1f}", 100 * share); });
  add(rows, fmt::format("causal ATE SE(3) from {:g} s on [m]", options.from), judgement.late,
      [](const ErrorStatistics& s) { return fmt::format("{:.4f} (max {:.4f})", s.rmse, s.max); });
  add(rows, "causal scale error [%]", judgement.early_scale, scale_text);
  add(rows, "final scale error [%]", judgement.final_scale, scale_text);
  add(rows, "largest causal step [mm]", judgement.causal_step, step_text);
  add(rows, "largest odometry step [mm]", judgement.odometry_step, step_text);
  for (const DeadReckoning& gap : judgement.gaps) {
    rows.push_back(
        {fmt::format("dead reckoning, {:.2f} to {:.2f} s", gap.begin, gap.end), gap_text(gap)});
  }
  add(rows, "causal error in dead reckoning [m]", judgement.causal_split, split_text);
  add(rows, "final error in dead reckoning [m]", judgement.final_split, split_text);
  return rows;
}

}  // namespace rover
