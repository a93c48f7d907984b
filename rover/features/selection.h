#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "rover/features/adaptive_threshold.h"
#include "rover/features/extractor.h"
#include "rover/features/local_maxima.h"

namespace rover {

struct SelectionOptions {
  AdaptiveThresholdOptions threshold;
  float spread = 0.15f;  // share of the budget that is shared out over the cells of a grid
  int cell = 64;         // px, side of such a cell

  void check() const;
};

struct Selection {
  std::vector<Candidate> chosen;  // ordered by descending score, then raster order
  float threshold = 0;            // of the adaptive rule, or the request's own
  int candidates = 0;             // how many there were to choose from
};

// Chooses at most request.budget candidates: those at or above the threshold, but never fewer than
// min_features of the best; when there are too many, the best ones for (1 - spread) of the budget
// and the rest evenly over the grid's cells, the best of each. `radius` is that of the non-maximum
// suppression: of equal scores closer than that the first in raster order stays.
Selection select_candidates(std::vector<Candidate> candidates, const ExtractionRequest& request,
                            const SelectionOptions& options, int radius);

}  // namespace rover
