#include "rover/features/detection.h"

namespace rover {

void DetectionOptions::check() const {
  maxima.check();
  selection.check();
}

FeatureSet detect(const ScoreMap& map, const DetectionOptions& options,
                  const ExtractionRequest& request, const Judgement& judgement, ThreadPool& pool,
                  std::vector<float>& scratch) {
  auto candidates =
      find_local_maxima(map, options.maxima, request.mask, options.loops(), pool, scratch);
  for (auto& candidate : candidates) candidate.score = judgement.score(candidate);
  const auto selection =
      select_candidates(std::move(candidates), request, options.selection, options.maxima.radius);
  FeatureSet features;
  features.image_size = {map.width, map.height};
  features.threshold = selection.threshold;
  features.candidates = selection.candidates;
  for (const auto& candidate : selection.chosen) {
    const Located located =
        judgement.locate({candidate.x, candidate.y, *map.at(candidate.x, candidate.y)});
    features.positions.push_back(located.position);
    features.scores.push_back(candidate.score);
    features.sigmas.push_back(located.sigma);
  }
  return features;
}

}  // namespace rover
