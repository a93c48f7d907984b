#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "rover/features/feature_set.h"

namespace rover {

// Feature `a` of the first image is feature `b` of the second.
struct Match {
  int a = -1;
  int b = -1;
  float score = 0;  // in (0, 1]; larger is surer
};

// One side of a match: the features and, for matchers that ask for it, the image.
struct MatchInput {
  const FeatureSet& features;
  const cv::Mat* image = nullptr;
};

// Joins the features of two images without any geometric prediction. match() is const and may be
// called from several threads at once. Matches are one to one and ordered by `a`.
class Matcher {
 public:
  virtual ~Matcher() = default;
  virtual std::vector<Match> match(const MatchInput& a, const MatchInput& b) const = 0;
  virtual bool needs_images() const { return false; }
};

}  // namespace rover
