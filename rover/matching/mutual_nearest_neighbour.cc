#include "rover/matching/mutual_nearest_neighbour.h"

#include <algorithm>
#include <cmath>

#include "rover/base/error.h"
#include "rover/matching/kernels.h"

namespace rover {

void MutualNearestNeighbourOptions::check() const {
  require(min_similarity >= 0 && min_similarity <= 1,
          "mutual nearest neighbour: min_similarity must be in [0, 1], not {}", min_similarity);
  require(max_ratio > 0 && max_ratio <= 1,
          "mutual nearest neighbour: max_ratio must be in (0, 1], not {}", max_ratio);
}

MutualNearestNeighbourMatcher::MutualNearestNeighbourMatcher(
    const MutualNearestNeighbourOptions& options)
    : options_(options) {
  options_.check();
}

namespace {

struct Nearest {
  std::vector<float> best;
  std::vector<int> index;
  std::vector<float> second;  // similarity of the runner-up

  explicit Nearest(int count) : best(count, -2.0f), index(count, -1), second(count, -2.0f) {}
};

struct NearestPair {
  Nearest in_b;  // of each feature of a
  Nearest in_a;  // of each feature of b
};

// The runner-up of each column in a row of similarities: what the best one displaces.
void update_seconds(const float* row, int count, const Nearest& columns,
                    std::vector<float>& seconds) {
  for (int j = 0; j < count; ++j) {
    seconds[j] = std::max(seconds[j], std::min(row[j], columns.best[j]));
  }
}

// Nearest neighbours both ways. The matrix of similarities is made a few rows at a time, so that
// they are still in the cache when they are searched.
NearestPair find_nearest(const Descriptors& a, const Descriptors& b, bool seconds) {
  const auto size = static_cast<int>(a.cols());
  const auto rows = static_cast<int>(a.rows()), columns = static_cast<int>(b.rows());
  const auto packed = pack_transposed(b.data(), columns, size);
  const int stride = static_cast<int>(packed.size()) / size;
  const MatchingKernels& kernels = matching_kernels();
  constexpr int kBlock = 24;
  std::vector<float> block(static_cast<std::size_t>(kBlock) * stride);
  NearestPair nearest{Nearest(rows), Nearest(columns)};
  for (int begin = 0; begin < rows; begin += kBlock) {
    const int count = std::min(kBlock, rows - begin);
    kernels.product(a.row(begin).data(), count, packed.data(), stride, size, block.data());
    for (int i = 0; i < count; ++i) {
      const float* row = block.data() + static_cast<std::ptrdiff_t>(i) * stride;
      const int r = begin + i;
      kernels.row_maximum(row, columns, &nearest.in_b.best[r], &nearest.in_b.index[r],
                          &nearest.in_b.second[r]);
      if (seconds) update_seconds(row, columns, nearest.in_a, nearest.in_a.second);
      kernels.column_maxima(row, columns, r, nearest.in_a.best.data(), nearest.in_a.index.data());
    }
  }
  return nearest;
}

bool distinct(float best, float second, float max_ratio) {
  const auto distance = [](float similarity) {
    return std::sqrt(std::max(0.0f, 2.0f - 2.0f * similarity));
  };
  return max_ratio >= 1 || distance(best) < max_ratio * distance(second);
}

}  // namespace

std::vector<Match> MutualNearestNeighbourMatcher::match(const MatchInput& a,
                                                        const MatchInput& b) const {
  if (a.features.empty() || b.features.empty()) return {};
  const auto [in_b, in_a] =
      find_nearest(a.features.descriptors, b.features.descriptors, options_.max_ratio < 1);
  std::vector<Match> matches;
  for (int i = 0; i < a.features.size(); ++i) {
    const int j = in_b.index[i];
    const float similarity = in_b.best[i];
    if (in_a.index[j] != i || similarity <= 0 || similarity < options_.min_similarity) continue;
    if (!distinct(similarity, in_b.second[i], options_.max_ratio)) continue;
    if (!distinct(similarity, in_a.second[j], options_.max_ratio)) continue;
    matches.push_back({i, j, std::min(similarity, 1.0f)});
  }
  return matches;
}

}  // namespace rover
