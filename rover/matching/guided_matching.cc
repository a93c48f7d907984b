#include "rover/matching/guided_matching.h"

#include <algorithm>
#include <cmath>

#include "rover/base/error.h"
#include "rover/matching/kernels.h"

namespace rover {

void GuidedMatchingOptions::check() const {
  require(min_similarity > 0 && min_similarity <= 1,
          "guided matching: min_similarity must be in (0, 1], not {}", min_similarity);
  require(max_ratio > 0, "guided matching: max_ratio must be positive, not {}", max_ratio);
}

FeatureGrid::FeatureGrid(const FeatureSet& features, int cell)
    : features_(features),
      cell_(cell),
      columns_(features.image_size.width / cell + 1),
      rows_(features.image_size.height / cell + 1),
      starts_(static_cast<std::size_t>(columns_) * rows_ + 1, 0),
      indices_(features.positions.size()) {
  const auto cell_of = [&](const Eigen::Vector2f& position) {
    const int column = std::clamp(static_cast<int>(position.x()) / cell_, 0, columns_ - 1);
    const int row = std::clamp(static_cast<int>(position.y()) / cell_, 0, rows_ - 1);
    return row * columns_ + column;
  };
  for (const auto& position : features.positions) ++starts_[cell_of(position) + 1];
  for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
  std::vector<int> next(starts_.begin(), starts_.end() - 1);
  for (int i = 0; i < features.size(); ++i) indices_[next[cell_of(features.positions[i])]++] = i;
}

void FeatureGrid::find(const Eigen::Vector2f& position, float radius,
                       std::vector<int>& found) const {
  found.clear();
  const auto cell_at = [&](float value, int count) {
    const float cell = std::floor(value / static_cast<float>(cell_));
    return static_cast<int>(std::clamp(cell, 0.0f, static_cast<float>(count - 1)));
  };
  const int left = cell_at(position.x() - radius, columns_);
  const int right = cell_at(position.x() + radius, columns_);
  const int bottom = cell_at(position.y() + radius, rows_);
  for (int row = cell_at(position.y() - radius, rows_); row <= bottom; ++row) {
    // The cells of one row are neighbours in indices_.
    const int end = starts_[row * columns_ + right + 1];
    for (int i = starts_[row * columns_ + left]; i < end; ++i) {
      const int index = indices_[i];
      if ((features_.positions[index] - position).squaredNorm() <= radius * radius) {
        found.push_back(index);
      }
    }
  }
  std::sort(found.begin(), found.end());
}

namespace {

float descriptor_distance(float similarity) {
  return std::sqrt(std::max(0.0f, 2.0f - 2.0f * similarity));
}

// The most similar of the candidates, if it is similar enough and clearly the most similar.
Match choose(int query, std::span<const int> candidates, std::span<const float> similarities,
             const GuidedMatchingOptions& options) {
  float best = -1, second = -1;
  Match match{query, -1, 0};
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (similarities[i] > best) {
      second = best;
      best = similarities[i];
      match.b = candidates[i];
    } else {
      second = std::max(second, similarities[i]);
    }
  }
  match.score = std::min(best, 1.0f);
  const bool distinct = descriptor_distance(best) < options.max_ratio * descriptor_distance(second);
  if (best < options.min_similarity || !distinct) match.b = -1;
  return match;
}

// Leaves each feature to the query that is most similar to it (the first of equals).
void keep_most_similar_query(int features, std::vector<Match>& matches) {
  std::vector<const Match*> keeper(features, nullptr);
  for (const Match& match : matches) {
    const Match*& kept = keeper[match.b];
    if (!kept || match.score > kept->score) kept = &match;
  }
  std::vector<Match> unique;
  for (const Match& match : matches) {
    if (keeper[match.b] == &match) unique.push_back(match);
  }
  matches = std::move(unique);
}

}  // namespace

std::vector<Match> match_guided(std::span<const GuidedQuery> queries, const FeatureGrid& grid,
                                const GuidedMatchingOptions& options, std::span<const char> free) {
  const FeatureSet& features = grid.features();
  const auto size = static_cast<int>(features.descriptors.cols());
  std::vector<Match> matches;
  std::vector<int> candidates;
  std::vector<float> similarities;
  for (std::size_t query = 0; query < queries.size(); ++query) {
    const auto& [position, radius, descriptor] = queries[query];
    grid.find(position, radius, candidates);
    if (!free.empty()) std::erase_if(candidates, [&](int index) { return !free[index]; });
    if (candidates.empty()) continue;
    similarities.resize(candidates.size());
    matching_kernels().similarities(descriptor, features.descriptors.data(), size,
                                    candidates.data(), static_cast<int>(candidates.size()),
                                    similarities.data());
    const Match match = choose(static_cast<int>(query), candidates, similarities, options);
    if (match.b >= 0) matches.push_back(match);
  }
  if (options.mutual) keep_most_similar_query(features.size(), matches);
  return matches;
}

}  // namespace rover
