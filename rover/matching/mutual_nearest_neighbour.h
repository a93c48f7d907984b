#pragma once

#include <vector>

#include "rover/matching/matcher.h"

namespace rover {

struct MutualNearestNeighbourOptions {
  float min_similarity = 0.0f;  // cosine of the two descriptors; below: no match
  float max_ratio = 1.0f;       // best to second best distance sqrt(2 - 2 cos), both ways; 1: off

  void check() const;
};

// Joins features that are each other's most similar ones. Exhaustive: one blocked matrix product.
// The score of a match is the cosine of its descriptors.
class MutualNearestNeighbourMatcher : public Matcher {
 public:
  // Throws InputError for options that make no sense.
  explicit MutualNearestNeighbourMatcher(const MutualNearestNeighbourOptions& options = {});

  std::vector<Match> match(const MatchInput& a, const MatchInput& b) const override;

 private:
  MutualNearestNeighbourOptions options_;
};

}  // namespace rover
