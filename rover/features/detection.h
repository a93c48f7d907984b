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

// Features of a score map of the image's size, all but their descriptors: maxima, selection, then
// `locate` for each that was chosen. `scratch` may be kept between calls.
FeatureSet detect(const ScoreMap& scores, const DetectionOptions& options,
                  const ExtractionRequest& request, ThreadPool& pool, std::vector<float>& scratch,
                  const std::function<Located(const Candidate&)>& locate);

}  // namespace rover
