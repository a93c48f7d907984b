#pragma once

#include <memory>

#include "rover/matching/feature_family.h"

namespace rover {

// Matches features whose descriptors are equal: right for the frames of map/test_map.h.
class EqualDescriptorMatcher : public Matcher {
 public:
  std::vector<Match> match(const MatchInput& a, const MatchInput& b) const override {
    std::vector<Match> matches;
    for (int i = 0; i < a.features.size(); ++i) {
      for (int j = 0; j < b.features.size(); ++j) {
        if (a.features.descriptors.row(i) == b.features.descriptors.row(j)) {
          matches.push_back({i, j, 1});
          break;
        }
      }
    }
    return matches;
  }
};

// A family without extractor, for stages that are handed frames.
inline FeatureFamily test_family() {
  FeatureFamily family;
  family.name = "test";
  family.matcher = family.classical = std::make_shared<EqualDescriptorMatcher>();
  return family;
}

}  // namespace rover
