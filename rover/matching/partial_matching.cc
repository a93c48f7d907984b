#include "rover/matching/partial_matching.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace rover {
namespace {

template <class T>
std::vector<T> select(const std::vector<T>& values, const std::vector<int>& rows) {
  std::vector<T> selected;
  selected.reserve(rows.size());
  for (const int row : rows) selected.push_back(values[static_cast<std::size_t>(row)]);
  return selected;
}

std::vector<int> best_rows(const FeatureSet& features, double share) {
  std::vector<int> rows(static_cast<std::size_t>(std::ceil(features.size() * share)));
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

}  // namespace

FeatureSet select_features(const FeatureSet& features, const std::vector<int>& rows) {
  FeatureSet selected;
  selected.image_size = features.image_size;
  selected.positions = select(features.positions, rows);
  selected.scores = select(features.scores, rows);
  selected.sigmas = select(features.sigmas, rows);
  selected.descriptors = features.descriptors(rows, Eigen::all);
  selected.threshold = features.threshold;
  selected.candidates = features.candidates;
  return selected;
}

std::vector<Match> match_some(const Matcher& matcher, const MatchInput& a,
                              const std::vector<int>& rows_a, const MatchInput& b,
                              const std::vector<int>& rows_b) {
  const FeatureSet some_a = select_features(a.features, rows_a);
  const FeatureSet some_b = select_features(b.features, rows_b);
  auto matches = matcher.match({some_a, a.image}, {some_b, b.image});
  for (Match& match : matches) {
    match.a = rows_a[static_cast<std::size_t>(match.a)];
    match.b = rows_b[static_cast<std::size_t>(match.b)];
  }
  return matches;
}

std::vector<Match> match_best(const Matcher& matcher, const MatchInput& a, const MatchInput& b,
                              double share) {
  return match_some(matcher, a, best_rows(a.features, share), b, best_rows(b.features, share));
}

}  // namespace rover
