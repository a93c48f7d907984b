#pragma once

#include <algorithm>

#include "rover/matching/feature_family.h"

namespace rover {

// Matches the features of equal number: right for the frames of map/test_map.h.
class EqualIndexMatcher : public Matcher {
 public:
  std::vector<Match> match(const MatchInput& a, const MatchInput& b) const override {
    std::vector<Match> matches;
    const int count = std::min(a.features.size(), b.features.size());
    for (int i = 0; i < count; ++i) matches.push_back({i, i, 1});
    return matches;
  }
};

// A family without extractor, for stages that are handed frames.
inline FeatureFamily test_family() {
  FeatureFamily family;
  family.name = "test";
  family.matcher = std::make_shared<EqualIndexMatcher>();
  return family;
}

}  // namespace rover
