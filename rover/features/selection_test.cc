#include "rover/features/selection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "rover/base/error.h"
#include "rover/base/random.h"

namespace rover {
namespace {

// Scores of 0 to 1, ten times that in the left quarter of 640x480.
std::vector<Candidate> clustered_candidates(int count) {
  Random random(1);
  std::vector<Candidate> candidates;
  for (int i = 0; i < count; ++i) {
    const int x = random.index(640), y = random.index(480);
    const auto score = static_cast<float>(random.uniform());
    candidates.push_back({x, y, x < 160 ? 10 * score : score});
  }
  return candidates;
}

SelectionOptions without_threshold() {
  SelectionOptions options;
  options.threshold.enabled = false;
  return options;
}

Selection choose(int budget, const SelectionOptions& options) {
  ExtractionRequest request;
  request.budget = budget;
  return select_candidates(clustered_candidates(2000), request, options, 4);
}

std::size_t cells_of(const Selection& selection) {
  std::set<std::pair<int, int>> cells;
  for (const auto& c : selection.chosen) cells.emplace(c.x / 64, c.y / 64);
  return cells.size();
}

TEST(Selection, KeepsTheBudgetAndTheOrder) {
  for (const int budget : {1, 7, 500, 5000}) {
    const auto selection = choose(budget, without_threshold());
    EXPECT_EQ(std::ssize(selection.chosen), std::min(budget, 2000));
    EXPECT_EQ(selection.candidates, 2000);
    EXPECT_TRUE(std::ranges::is_sorted(selection.chosen, std::greater<>(), &Candidate::score));
  }
}

TEST(Selection, TakesTheBestWithoutSpread) {
  auto options = without_threshold();
  options.spread = 0;
  auto all = clustered_candidates(2000);
  std::ranges::sort(all, std::greater<>(), &Candidate::score);
  const auto selection = choose(300, options);
  for (std::size_t i = 0; i < 300; ++i) EXPECT_EQ(selection.chosen[i].score, all[i].score);
}

TEST(Selection, SpreadsOverTheImage) {
  auto options = without_threshold();
  options.spread = 0;
  const auto best = choose(400, options);
  options.spread = 0.2f;
  const auto spread = choose(400, options);
  EXPECT_LT(cells_of(best), 40u);
  EXPECT_GT(cells_of(spread), 70u);
  // The best four fifths are in both.
  EXPECT_EQ(spread.chosen[319].score, best.chosen[319].score);
}

TEST(Selection, AppliesTheThresholdOfTheRuleOrOfTheRequest) {
  SelectionOptions options;
  options.threshold.min_features = 0;
  const auto own = choose(2000, options);
  EXPECT_GT(own.threshold, 0);
  for (const auto& c : own.chosen) EXPECT_GE(c.score, own.threshold);
  EXPECT_LT(own.chosen.size(), 1000u);
  ExtractionRequest request;
  request.budget = 2000;
  request.threshold = 9.0f;
  const auto given = select_candidates(clustered_candidates(2000), request, options, 4);
  EXPECT_EQ(given.threshold, 9.0f);
  EXPECT_GE(given.chosen.back().score, 9.0f);
  EXPECT_LT(given.chosen.size(), own.chosen.size());
}

TEST(Selection, KeepsAMinimumOfTheBest) {
  SelectionOptions options;
  options.threshold.min_features = 150;
  options.threshold.low = options.threshold.high = 1000;
  const auto selection = choose(800, options);
  EXPECT_EQ(selection.chosen.size(), 150u);
  EXPECT_EQ(choose(100, options).chosen.size(), 100u);
}

TEST(Selection, KeepsOneOfAPlateau) {
  const std::vector<Candidate> plateau = {{20, 10, 5}, {21, 10, 5}, {18, 11, 5}, {40, 10, 5}};
  const auto selection = select_candidates(plateau, {}, without_threshold(), 4);
  ASSERT_EQ(selection.chosen.size(), 2u);
  EXPECT_EQ(selection.chosen[0].x, 20);
  EXPECT_EQ(selection.chosen[1].x, 40);
}

TEST(Selection, TakesNoneFromNone) {
  const auto selection = select_candidates({}, {}, {}, 4);
  EXPECT_TRUE(selection.chosen.empty());
  EXPECT_EQ(selection.candidates, 0);
}

TEST(Selection, RefusesOptionsThatMakeNoSense) {
  SelectionOptions options;
  EXPECT_NO_THROW(options.check());
  options.spread = 1.1f;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.cell = 0;
  EXPECT_THROW(options.check(), InputError);
}

}  // namespace
}  // namespace rover
