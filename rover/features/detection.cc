#include "rover/features/detection.h"

namespace rover {

void DetectionOptions::check() const {
  maxima.check();
  selection.check();
}

FeatureSet detect(const ScoreMap& scores, const DetectionOptions& options,
                  const ExtractionRequest& request, ThreadPool& pool, std::vector<float>& scratch,
                  const std::function<Located(const Candidate&)>& locate) {
  auto candidates =
      find_local_maxima(scores, options.maxima, request.mask, options.loops(), pool, scratch);
  const auto selection =
      select_candidates(std::move(candidates), request, options.selection, options.maxima.radius);
  FeatureSet features;
  features.image_size = {scores.width, scores.height};
  features.threshold = selection.threshold;
  features.candidates = selection.candidates;
  for (const auto& candidate : selection.chosen) {
    const Located located = locate(candidate);
    features.positions.push_back(located.position);
    features.scores.push_back(candidate.score);
    features.sigmas.push_back(located.sigma);
  }
  return features;
}

}  // namespace rover
