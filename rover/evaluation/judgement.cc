#include "rover/evaluation/judgement.h"

#include <nlohmann/json.hpp>

#include "rover/base/error.h"

namespace rover {
namespace {

std::optional<AlignedErrors> judge_aligned(std::span<const PosePair> pairs, AlignmentKind kind) {
  const auto alignment = align(pairs, kind);
  if (!alignment) return std::nullopt;
  const std::vector<PosePair> aligned = move_estimates(*alignment, pairs);
  const RelativeErrors relative = frame_to_frame_errors(aligned);
  return AlignedErrors{*alignment, statistics_of(position_errors(aligned)),
                       statistics_of(relative.translation), statistics_of(relative.rotation),
                       distance_errors(aligned)};
}

nlohmann::json statistics_json(const ErrorStatistics& s) {
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median},
          {"max", s.max},   {"min", s.min},   {"std", s.std}};
}

nlohmann::json errors_json(const std::optional<AlignedErrors>& errors) {
  if (!errors) return nullptr;
  const auto& distance = errors->per_distance;
  return {{"scale", errors->reference_from_estimate.scale},
          {"ate_m", statistics_json(errors->position)},
          {"rpe_frame_m", statistics_json(errors->relative_translation)},
          {"rpe_frame_deg", statistics_json(errors->relative_rotation)},
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
  result.rigid = judge_aligned(result.pairs, AlignmentKind::kRigid);
  result.similarity = judge_aligned(result.pairs, AlignmentKind::kSimilarity);
  result.gravity = judge_aligned(result.pairs, AlignmentKind::kGravity);
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
