#pragma once

#include <functional>
#include <vector>

#include "rover/base/thread_pool.h"
#include "rover/features/feature_set.h"
#include "rover/features/local_maxima.h"
#include "rover/features/selection.h"

namespace rover {

// What the extractors that look for maxima of a score map have in common.
struct DetectionOptions {
  MaximaOptions maxima;
  SelectionOptions selection;
  const kernels::Kernels* kernels = nullptr;  // null: the best that this machine supports

  void check() const;
  const kernels::Kernels& loops() const { return kernels ? *kernels : kernels::best_kernels(); }
};

// Where a maximum really is (px), and how well that is known (px, standard deviation per axis).
struct Located {
  Eigen::Vector2f position;
  float sigma;
};

// What an extractor does to the maxima of its map.
struct Judgement {
  std::function<float(const Candidate&)> score;     // by which they are chosen
  std::function<Located(const Candidate&)> locate;  // each that was chosen; sees the map's value
};

// Features of a score map of the image's size, all but their descriptors: maxima, scores,
// selection, positions. `scratch` may be kept between calls.
FeatureSet detect(const ScoreMap& map, const DetectionOptions& options,
                  const ExtractionRequest& request, const Judgement& judgement, ThreadPool& pool,
                  std::vector<float>& scratch);

}  // namespace rover
