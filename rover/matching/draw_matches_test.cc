#include "rover/matching/draw_matches.h"

#include <gtest/gtest.h>

#include "rover/matching/test_features.h"

namespace rover {
namespace {

TEST(DrawMatches, PutsImagesSideBySideAndColoursByScore) {
  const cv::Mat a(50, 60, CV_8UC1, cv::Scalar(10)), b(40, 70, CV_8UC1, cv::Scalar(20));
  FeatureSet of_a = random_features(2, 4, 1), of_b = random_features(2, 4, 2);
  of_a.positions = {{10, 25}, {10, 10}};
  of_b.positions = {{20, 25}, {40, 10}};
  const std::vector<Match> matches = {{0, 0, 1.0f}, {1, 1, 0.01f}};
  const cv::Mat canvas = draw_matches(a, of_a, b, of_b, matches);
  ASSERT_EQ(canvas.size(), cv::Size(130, 50));
  ASSERT_EQ(canvas.type(), CV_8UC3);
  EXPECT_EQ(canvas.at<cv::Vec3b>(45, 2), cv::Vec3b(10, 10, 10));
  EXPECT_EQ(canvas.at<cv::Vec3b>(35, 120), cv::Vec3b(20, 20, 20));
  EXPECT_EQ(canvas.at<cv::Vec3b>(45, 120), cv::Vec3b(0, 0, 0));  // below the shorter image
  const auto sure = canvas.at<cv::Vec3b>(25, 50), unsure = canvas.at<cv::Vec3b>(10, 50);
  EXPECT_GT(sure[1], 200);
  EXPECT_LT(sure[2], 50);
  EXPECT_GT(unsure[2], 200);
  EXPECT_LT(unsure[1], 50);
}

}  // namespace
}  // namespace rover
