#include "rover/map/feature_choice.h"

#include <gtest/gtest.h>

#include "rover/map/test_map.h"

namespace rover {
namespace {

// Of ten features the even ones have landmarks.
Frame half_joined() {
  Frame frame = test_frame(test_rig(), test_points(10, 1), SE3(), 0);
  for (int i = 0; i < 10; i += 2) frame[i].landmark = {i};
  return frame;
}

TEST(ChooseFeatures, PrefersAKindAndThenTheBest) {
  const Frame frame = half_joined();
  EXPECT_EQ(choose_features(frame, 0.3, Prefer::kWithLandmark), (std::vector<int>{0, 2, 4}));
  EXPECT_EQ(choose_features(frame, 0.3, Prefer::kWithoutLandmark), (std::vector<int>{1, 3, 5}));
  EXPECT_EQ(choose_features(frame, 0.7, Prefer::kWithLandmark),
            (std::vector<int>{0, 1, 2, 3, 4, 6, 8}));
}

TEST(ChooseFeatures, TakesAllOrNone) {
  EXPECT_EQ(choose_features(half_joined(), 1, Prefer::kWithLandmark).size(), 10u);
  EXPECT_TRUE(choose_features(Frame(), 0.5, Prefer::kWithLandmark).empty());
}

}  // namespace
}  // namespace rover
