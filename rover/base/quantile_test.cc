#include "rover/base/quantile.h"

#include <gtest/gtest.h>

namespace rover {
namespace {

TEST(Quantile, IsAnElement) {
  const std::vector<double> values = {5, 1, 4, 2, 3};
  EXPECT_EQ(median(values), 3);
  EXPECT_EQ(quantile(values, 0), 1);
  EXPECT_EQ(quantile(values, 1), 5);
  EXPECT_EQ(quantile(values, 0.8), 4);
}

TEST(Quantile, OfAnEvenCountTakesTheUpperMiddle) {
  EXPECT_EQ(median(std::vector<int>{4, 1, 3, 2}), 3);
}

TEST(Quantile, OfNothingIsZero) { EXPECT_EQ(median(std::vector<double>()), 0); }

}  // namespace
}  // namespace rover
