#include "rover/features/adaptive_threshold.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "rover/base/error.h"

namespace rover {
namespace {

// Mean 3, standard deviation 2.
const std::vector<float> kScores = {1, 5, 1, 5};

TEST(AdaptiveThreshold, IsTheRuleOfThePaper) {
  AdaptiveThresholdOptions options;
  options.mu1 = 0.5f;
  options.mu2 = 0.01f;
  for (const int matches : {0, 50, 400}) {
    const double expected = 3 + 2 * (0.5 + 0.5 / (1 + std::exp(-0.01 * matches)));
    EXPECT_NEAR(adaptive_threshold(kScores, matches, options), expected, 1e-5);
  }
}

TEST(AdaptiveThreshold, RisesWithMatchesBetweenItsLimits) {
  AdaptiveThresholdOptions options;
  options.mu1 = 1;
  const float lost = adaptive_threshold(kScores, 0, options);
  EXPECT_FLOAT_EQ(lost, 3 + 2 * (0.5f + 0.5f));
  float last = lost;
  for (const int matches : {20, 100, 200}) {
    const float threshold = adaptive_threshold(kScores, matches, options);
    EXPECT_GT(threshold, last);
    last = threshold;
  }
  EXPECT_LT(last, 3 + 2 * 1.5f);
}

TEST(AdaptiveThreshold, ChoosesTheSameAtAnyContrast) {
  std::vector<float> dark;
  for (const float score : kScores) dark.push_back(score / 10);
  EXPECT_NEAR(10 * adaptive_threshold(dark, 80, {}), adaptive_threshold(kScores, 80, {}), 1e-5);
}

TEST(AdaptiveThreshold, IsClampedAndCanBeSwitchedOff) {
  AdaptiveThresholdOptions options;
  options.low = 4.5f;
  options.high = 4.6f;
  EXPECT_EQ(adaptive_threshold(kScores, 1000, options), 4.5f);
  options.low = 1;
  options.high = 2;
  EXPECT_EQ(adaptive_threshold(kScores, 0, options), 2);
  EXPECT_EQ(adaptive_threshold({}, 0, options), 1);
  options.enabled = false;
  EXPECT_EQ(adaptive_threshold(kScores, 0, options), 1);
}

TEST(AdaptiveThreshold, RefusesOptionsThatMakeNoSense) {
  AdaptiveThresholdOptions options;
  EXPECT_NO_THROW(options.check());
  options.mu1 = -1;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.mu2 = -1;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.min_features = -1;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.high = options.low - 1;
  EXPECT_THROW(options.check(), InputError);
}

}  // namespace
}  // namespace rover
