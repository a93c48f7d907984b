#include "rover/evaluation/judgement.h"

#include <nlohmann/json.hpp>

#include "rover/base/error.h"

namespace rover {
namespace {

std::optional<AlignedErrors> judge_aligned(const Judgement& judgement, const Trajectory& estimate,
                                           const std::optional<BlindStretch>& blind,
                                           AlignmentKind kind) {
  const auto alignment = align(judgement.pairs, kind);
  if (!alignment) return std::nullopt;
  const std::vector<PosePair> aligned = move_estimates(*alignment, judgement.pairs);
  const RelativeErrors relative = frame_to_frame_errors(aligned);
  AlignedErrors errors{*alignment,
                       statistics_of(position_errors(aligned)),
                       statistics_of(relative.translation),
                       statistics_of(relative.rotation),
                       distance_errors(aligned),
                       std::nullopt};
  if (blind) errors.drift = measure_drift(estimate, judgement.pairs, *blind, kind);
  return errors;
}

nlohmann::json statistics_json(const ErrorStatistics& s) {
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median},
          {"max", s.max},   {"min", s.min},   {"std", s.std}};
}

nlohmann::json drift_json(const std::optional<Drift>& drift) {
  if (!drift) return nullptr;
  return {{"blind_s", drift->blind},
          {"path_m", drift->path},
          {"end_m", statistics_json(drift->position)},
          {"percent", drift->percent}};
}

nlohmann::json errors_json(const std::optional<AlignedErrors>& errors) {
  if (!errors) return nullptr;
  const auto& distance = errors->per_distance;
  return {{"scale", errors->reference_from_estimate.scale},
          {"ate_m", statistics_json(errors->position)},
          {"rpe_frame_m", statistics_json(errors->relative_translation)},
          {"rpe_frame_deg", statistics_json(errors->relative_rotation)},
          {"drift", drift_json(errors->drift)},
          {"rpe_distance",
           {{"lengths_m", distance.lengths},
            {"count", distance.count},
            {"translation_percent", distance.translation},
            {"rotation_deg_per_m", distance.rotation}}}};
}

}  // namespace

Judgement judge(const std::string& name, const Trajectory& estimate, const Trajectory& reference,
                double max_difference, const std::optional<Offered>& offered) {
  Judgement result;
  result.name = name;
  result.poses = estimate.size();
  result.pairs = associate(estimate, reference, max_difference);
  result.associated = result.pairs.size();
  require(result.associated > 0,
          "{}: no pose lies within {} s of one of the reference; are both of one clock?", name,
          max_difference);
  result.path = path_length(result.pairs);
  result.longest_gap = longest_gap(estimate, offered ? offered->first : estimate.front().time,
                                   offered ? offered->last : estimate.back().time);
  if (offered && offered->frames > 0) {
    result.coverage = static_cast<double>(result.poses) / static_cast<double>(offered->frames);
  }
  const auto blind = find_blind_stretch(reference, estimate.front().time, estimate.back().time);
  result.rigid = judge_aligned(result, estimate, blind, AlignmentKind::kRigid);
  result.similarity = judge_aligned(result, estimate, blind, AlignmentKind::kSimilarity);
  result.gravity = judge_aligned(result, estimate, blind, AlignmentKind::kUpright);
  return result;
}

nlohmann::json to_json(const Judgement& judgement) {
  nlohmann::json json = {{"poses", judgement.poses},
                         {"associated", judgement.associated},
                         {"path_m", judgement.path},
                         {"longest_gap_s", judgement.longest_gap},
                         {"se3", errors_json(judgement.rigid)},
                         {"sim3", errors_json(judgement.similarity)},
                         {"yaw", errors_json(judgement.gravity)}};
  json["coverage"] = judgement.coverage ? nlohmann::json(*judgement.coverage) : nullptr;
  return json;
}

}  // namespace rover
