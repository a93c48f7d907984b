#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "rover/features/feature_set.h"
#include "rover/matching/matcher.h"

namespace rover {

// Where a known thing (a landmark) is expected in an image, and what it looks like.
struct GuidedQuery {
  Eigen::Vector2f position;           // px, predicted
  float radius = 0;                   // px, of the search gate
  const float* descriptor = nullptr;  // unit norm, of the feature set's size
};

struct GuidedMatchingOptions {
  float min_similarity = 0.75f;  // cosine of the two descriptors
  float max_ratio = 0.9f;        // best to second best distance sqrt(2 - 2 cos), within the gate
  bool mutual = true;            // one feature answers one query: the most similar one keeps it

  void check() const;
};

// Buckets of a feature set's positions for radius search. Keeps a reference to the features.
class FeatureGrid {
 public:
  explicit FeatureGrid(const FeatureSet& features, int cell = 32);

  const FeatureSet& features() const { return features_; }
  // Indices of the features within `radius` px of a position, ascending.
  void find(const Eigen::Vector2f& position, float radius, std::vector<int>& found) const;

 private:
  const FeatureSet& features_;
  int cell_;
  int columns_;
  int rows_;
  std::vector<int> starts_;   // of each cell in indices_, plus the end
  std::vector<int> indices_;  // feature indices, by cell
};

// Matches queries (a) to features (b) by descriptor inside their gates; ordered by query. `free`,
// if not empty, says which features may be taken.
std::vector<Match> match_guided(std::span<const GuidedQuery> queries, const FeatureGrid& grid,
                                const GuidedMatchingOptions& options,
                                std::span<const char> free = {});

}  // namespace rover
