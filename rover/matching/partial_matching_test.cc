#include "rover/matching/partial_matching.h"

#include <gtest/gtest.h>

#include "rover/matching/test_features.h"
#include "rover/matching/test_matcher.h"

namespace rover {
namespace {

TEST(PartialMatching, SelectsWholeFeatures) {
  const FeatureSet features = random_features(20, 8, 1);
  const FeatureSet some = select_features(features, {3, 7, 19});
  ASSERT_EQ(some.size(), 3);
  EXPECT_EQ(some.image_size, features.image_size);
  EXPECT_EQ(some.positions[1], features.positions[7]);
  EXPECT_EQ(some.scores[2], features.scores[19]);
  EXPECT_EQ(some.sigmas[0], features.sigmas[3]);
  EXPECT_EQ(some.descriptors.row(2), features.descriptors.row(19));
}

TEST(PartialMatching, NamesFeaturesOfTheWholeSets) {
  const FeatureSet features = random_features(20, 8, 1);
  const EqualDescriptorMatcher matcher;
  const auto matches = match_some(matcher, {features}, {2, 5, 9, 12}, {features}, {0, 5, 12, 13});
  ASSERT_EQ(matches.size(), 2u);
  EXPECT_EQ(matches[0].a, 5);
  EXPECT_EQ(matches[0].b, 5);
  EXPECT_EQ(matches[1].a, 12);
  EXPECT_EQ(matches[1].b, 12);
}

TEST(PartialMatching, TakesTheBestShare) {
  const FeatureSet features = random_features(21, 8, 1);
  const EqualDescriptorMatcher matcher;
  EXPECT_EQ(match_best(matcher, {features}, {features}, 1).size(), 21u);
  const auto matches = match_best(matcher, {features}, {features}, 0.5);
  ASSERT_EQ(matches.size(), 11u);
  EXPECT_EQ(matches.back().a, 10);
}

TEST(PartialMatching, OfNothingIsNothing) {
  const FeatureSet none = random_features(0, 8, 1);
  EXPECT_TRUE(match_best(EqualDescriptorMatcher(), {none}, {none}, 0.5).empty());
}

}  // namespace
}  // namespace rover
