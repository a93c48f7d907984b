#include "rover/matching/guided_matching.h"

#include <numeric>

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/matching/test_features.h"

namespace rover {
namespace {

TEST(FeatureGrid, FindsWhatABruteForceSearchFinds) {
  const FeatureSet features = random_features(500, 4, 1);
  Random random(2);
  for (int cell : {8, 32, 1000}) {
    const FeatureGrid grid(features, cell);
    for (int trial = 0; trial < 200; ++trial) {
      const Eigen::Vector2f at(static_cast<float>(random.uniform(-100, 740)),
                               static_cast<float>(random.uniform(-100, 580)));
      const float radius = static_cast<float>(random.uniform(0, 120));
      std::vector<int> expected, found = {-5};
      for (int i = 0; i < features.size(); ++i) {
        if ((features.positions[i] - at).squaredNorm() <= radius * radius) expected.push_back(i);
      }
      grid.find(at, radius, found);
      EXPECT_EQ(found, expected);
    }
  }
}

TEST(FeatureGrid, SurvivesPositionsOutsideTheImageAndNoFeatures) {
  FeatureSet features = random_features(2, 4, 1);
  features.positions = {{-3, -3}, {700, 500}};
  std::vector<int> found;
  FeatureGrid(features).find({0, 0}, 10, found);
  EXPECT_EQ(found, std::vector<int>{0});
  FeatureGrid(features).find({690, 490}, 20, found);
  EXPECT_EQ(found, std::vector<int>{1});
  const FeatureSet none = random_features(0, 4, 1);
  FeatureGrid(none).find({5, 5}, 1e9f, found);
  EXPECT_TRUE(found.empty());
}

class GuidedMatching : public testing::Test {
 protected:
  static constexpr int kCount = 300;
  FeatureSet a_ = random_features(kCount, 64, 1);
  FeatureSet b_ = shuffled_features(a_, 0.04f, 2);

  std::vector<GuidedQuery> queries(float radius) const {
    std::vector<GuidedQuery> made;
    made.reserve(kCount);
    for (int i = 0; i < kCount; ++i) {
      made.push_back(
          {a_.positions[i] + Eigen::Vector2f(2, -1), radius, a_.descriptors.row(i).data()});
    }
    return made;
  }
};

TEST_F(GuidedMatching, FindsAllWithinTheGateOnly) {
  const FeatureGrid grid(b_);
  const auto matches = match_guided(queries(40), grid, {});
  ASSERT_EQ(matches.size(), kCount);
  for (int i = 0; i < kCount; ++i) {
    EXPECT_EQ(matches[i].a, i);
    EXPECT_EQ(matches[i].b, (i * 7 + 3) % kCount);
    EXPECT_GT(matches[i].score, 0.75f);
  }
  EXPECT_TRUE(match_guided(queries(2), grid, {}).empty());  // positions are sqrt(5) px off
}

TEST_F(GuidedMatching, LeavesTakenFeaturesAlone) {
  std::vector<char> free(kCount, 1);
  free[3] = 0;  // the partner of query 0
  const auto matches = match_guided(queries(40), FeatureGrid(b_), {}, free);
  EXPECT_EQ(matches.size(), kCount - 1);
  EXPECT_EQ(matches.front().a, 1);
}

TEST_F(GuidedMatching, RefusesDissimilarAndAmbiguousOnes) {
  GuidedMatchingOptions options;
  b_.descriptors.row(3) = -b_.descriptors.row(3);
  EXPECT_EQ(match_guided(queries(40), FeatureGrid(b_), options).size(), kCount - 1);

  // Another feature nearby that looks the same, and one far away that does not matter.
  b_.descriptors.row(3) = a_.descriptors.row(0);
  b_.descriptors.row(10) = a_.descriptors.row(0);
  b_.positions[10] = b_.positions[3] + Eigen::Vector2f(12, 0);
  auto matches = match_guided(queries(20), FeatureGrid(b_), options);
  ASSERT_FALSE(matches.empty());
  EXPECT_NE(matches.front().a, 0);
  b_.positions[10] = b_.positions[3] + Eigen::Vector2f(60, 0);
  matches = match_guided(queries(20), FeatureGrid(b_), options);
  EXPECT_EQ(matches.front().a, 0);
}

TEST_F(GuidedMatching, TheMoreSimilarQueryKeepsTheFeature) {
  Descriptors noisy = b_.descriptors.row(3) + 0.3f * b_.descriptors.row(4);
  noisy.normalize();
  const std::vector<GuidedQuery> both = {{b_.positions[3], 5, noisy.data()},
                                         {b_.positions[3], 5, b_.descriptors.row(3).data()}};
  GuidedMatchingOptions options;
  auto matches = match_guided(both, FeatureGrid(b_), options);
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_EQ(matches[0].a, 1);
  EXPECT_EQ(matches[0].b, 3);
  options.mutual = false;
  EXPECT_EQ(match_guided(both, FeatureGrid(b_), options).size(), 2u);
}

TEST(GuidedMatchingOptions, ChecksItself) {
  EXPECT_NO_THROW(GuidedMatchingOptions{}.check());
  EXPECT_THROW((GuidedMatchingOptions{.min_similarity = 0}.check()), InputError);
  EXPECT_THROW((GuidedMatchingOptions{.max_ratio = -1}.check()), InputError);
}

}  // namespace
}  // namespace rover
