#include "rover/features/selection.h"

#include <algorithm>
#include <map>
#include <tuple>

#include "rover/base/error.h"

namespace rover {
namespace {

bool is_better(const Candidate& a, const Candidate& b) {
  return std::tie(b.score, a.y, a.x, a.index) < std::tie(a.score, b.y, b.x, b.index);
}

float threshold_for(const std::vector<Candidate>& candidates, const ExtractionRequest& request,
                    const AdaptiveThresholdOptions& options) {
  if (request.threshold) return *request.threshold;
  std::vector<float> scores;
  scores.reserve(candidates.size());
  for (const auto& candidate : candidates) scores.push_back(candidate.score);
  return adaptive_threshold(scores, request.last_matches, options);
}

// Moves those that pass to the front, sorted; drops the others.
void keep_passing(std::vector<Candidate>& candidates, float threshold, int minimum) {
  auto passing = std::partition(candidates.begin(), candidates.end(),
                                [&](const Candidate& c) { return c.score >= threshold; });
  if (passing - candidates.begin() < minimum) {
    passing = candidates.begin() + std::min<std::ptrdiff_t>(minimum, std::ssize(candidates));
    std::nth_element(candidates.begin(), passing, candidates.end(), is_better);
  }
  candidates.erase(passing, candidates.end());
  std::sort(candidates.begin(), candidates.end(), is_better);
}

bool ties_with_kept(const std::vector<Candidate>& kept, const Candidate& candidate, int radius) {
  for (auto other = kept.rbegin(); other != kept.rend() && other->score == candidate.score;
       ++other) {
    if (std::abs(other->x - candidate.x) <= radius && std::abs(other->y - candidate.y) <= radius) {
      return true;
    }
  }
  return false;
}

// Sorted candidates without the later ones of each plateau.
std::vector<Candidate> without_ties(const std::vector<Candidate>& sorted, int radius) {
  std::vector<Candidate> kept;
  kept.reserve(sorted.size());
  for (const auto& candidate : sorted) {
    if (!ties_with_kept(kept, candidate, radius)) kept.push_back(candidate);
  }
  return kept;
}

// Each candidate's place among those of its cell, from the best. Sorted input.
std::vector<int> ranks_in_cells(const std::vector<Candidate>& sorted, int cell) {
  std::map<std::pair<int, int>, int> counts;
  std::vector<int> ranks;
  ranks.reserve(sorted.size());
  for (const auto& c : sorted) ranks.push_back(counts[{c.y / cell, c.x / cell}]++);
  return ranks;
}

// The best ones first, then cell by cell: those of the lowest rank in their cells, better scores
// first among equals.
std::vector<Candidate> spread_over_cells(const std::vector<Candidate>& sorted, int budget,
                                         const SelectionOptions& options) {
  const auto ranks = ranks_in_cells(sorted, options.cell);
  const int best = static_cast<int>(static_cast<float>(budget) * (1 - options.spread));
  std::vector<std::size_t> order(sorted.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin() + best, order.end(),
                   [&](std::size_t a, std::size_t b) { return ranks[a] < ranks[b]; });
  order.resize(static_cast<std::size_t>(budget));
  std::sort(order.begin(), order.end());
  std::vector<Candidate> chosen;
  for (const std::size_t i : order) chosen.push_back(sorted[i]);
  return chosen;
}

}  // namespace

void SelectionOptions::check() const {
  threshold.check();
  require(spread >= 0 && spread <= 1, "feature selection: spread must be 0 to 1, not {}", spread);
  require(cell >= 8, "feature selection: cell must be at least 8 px, not {}", cell);
}

Selection select_candidates(std::vector<Candidate> candidates, const ExtractionRequest& request,
                            const SelectionOptions& options, int radius) {
  Selection selection;
  selection.candidates = static_cast<int>(candidates.size());
  selection.threshold = threshold_for(candidates, request, options.threshold);
  keep_passing(candidates, selection.threshold, options.threshold.min_features);
  selection.chosen = without_ties(candidates, radius);
  if (std::ssize(selection.chosen) > request.budget) {
    selection.chosen = spread_over_cells(selection.chosen, request.budget, options);
  }
  return selection;
}

}  // namespace rover
