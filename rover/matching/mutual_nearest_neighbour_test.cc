#include "rover/matching/mutual_nearest_neighbour.h"

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/matching/test_features.h"

namespace rover {
namespace {

std::vector<Match> match(const FeatureSet& a, const FeatureSet& b,
                         const MutualNearestNeighbourOptions& options = {}) {
  return MutualNearestNeighbourMatcher(options).match({a}, {b});
}

TEST(MutualNearestNeighbour, FindsAPermutation) {
  for (int count : {1, 2, 33, 500}) {
    const FeatureSet a = random_features(count, 64, 1);
    const FeatureSet b = shuffled_features(a, 0.02f, 2);
    const auto matches = match(a, b);
    ASSERT_EQ(matches.size(), count);
    for (int i = 0; i < count; ++i) {
      EXPECT_EQ(matches[i].a, i);
      EXPECT_EQ(matches[i].b, (i * 7 + 3) % count);
      EXPECT_GT(matches[i].score, 0.9f);
      EXPECT_LE(matches[i].score, 1.0f);
    }
  }
}

// The definition, written as plainly as it can be.
std::vector<std::pair<int, int>> mutual_by_definition(const FeatureSet& a, const FeatureSet& b,
                                                      float max_ratio) {
  const Descriptors s = a.descriptors * b.descriptors.transpose();
  const auto ratio = [](Eigen::VectorXf values) {
    std::sort(values.begin(), values.end(), std::greater<>());
    return std::sqrt(2 - 2 * values[0]) / std::sqrt(2 - 2 * values[1]);
  };
  std::vector<std::pair<int, int>> pairs;
  for (int i = 0; i < s.rows(); ++i) {
    Eigen::Index j = 0, back = 0;
    s.row(i).maxCoeff(&j);
    s.col(j).maxCoeff(&back);
    if (back == i && ratio(s.row(i)) <= max_ratio && ratio(s.col(j)) <= max_ratio) {
      pairs.emplace_back(i, j);
    }
  }
  return pairs;
}

TEST(MutualNearestNeighbour, AgreesWithTheDefinition) {
  const FeatureSet a = random_features(77, 32, 1), b = random_features(130, 32, 2);
  for (float max_ratio : {1.0f, 0.95f, 0.9f}) {
    MutualNearestNeighbourOptions options;
    options.max_ratio = max_ratio;
    const auto expected = mutual_by_definition(a, b, max_ratio);
    const auto matches = match(a, b, options);
    ASSERT_EQ(matches.size(), expected.size());
    EXPECT_FALSE(expected.empty());
    for (std::size_t i = 0; i < matches.size(); ++i) {
      EXPECT_EQ(std::pair(matches[i].a, matches[i].b), expected[i]);
    }
  }
}

TEST(MutualNearestNeighbour, KeepsTheMinimumSimilarity) {
  const FeatureSet a = random_features(100, 64, 1);
  const FeatureSet b = shuffled_features(a, 0.1f, 2);
  const auto all = match(a, b);
  MutualNearestNeighbourOptions options;
  options.min_similarity = 0.8f;
  const auto some = match(a, b, options);
  EXPECT_LT(some.size(), all.size());
  EXPECT_FALSE(some.empty());
  for (const Match& m : some) EXPECT_GE(m.score, 0.8f);
}

TEST(MutualNearestNeighbour, NothingToMatch) {
  const FeatureSet none = random_features(0, 64, 1), some = random_features(5, 64, 2);
  EXPECT_TRUE(match(none, some).empty());
  EXPECT_TRUE(match(some, none).empty());
  EXPECT_TRUE(match(none, none).empty());
}

TEST(MutualNearestNeighbour, ChecksItsOptions) {
  EXPECT_THROW(MutualNearestNeighbourMatcher({.min_similarity = 2, .max_ratio = 1}), InputError);
  EXPECT_THROW(MutualNearestNeighbourMatcher({.min_similarity = 0, .max_ratio = 0}), InputError);
}

}  // namespace
}  // namespace rover
