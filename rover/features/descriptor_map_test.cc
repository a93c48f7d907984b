#include "rover/features/descriptor_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "rover/base/random.h"

namespace rover {
namespace {

constexpr int kChannels = 64, kWidth = 7, kHeight = 5;

class DescriptorMapTest : public ::testing::Test {
 protected:
  DescriptorMapTest() : planes_(kChannels * kWidth * kHeight) {
    Random random(3);
    for (float& value : planes_) value = static_cast<float>(random.uniform(-1, 1));
  }

  Eigen::VectorXf cell(int i, int j) const {
    Eigen::VectorXf values(kChannels);
    for (int c = 0; c < kChannels; ++c) values[c] = planes_[(c * kHeight + j) * kWidth + i];
    return values.normalized();
  }

  Eigen::VectorXf sample(float x, float y) {
    const DescriptorMap map(planes_.data(), kChannels, kWidth, kHeight, kernels::best_kernels(),
                            pool_, cells_);
    return map.sample(std::vector<Eigen::Vector2f>{{x, y}}, pool_).row(0);
  }

  std::vector<float> planes_, cells_;
  ThreadPool pool_{2};
};

TEST_F(DescriptorMapTest, IsTheCellAtItsCentre) {
  EXPECT_LT((sample(8 * 2 + 3.5f, 8 * 3 + 3.5f) - cell(2, 3)).norm(), 1e-5);
}

TEST_F(DescriptorMapTest, IsInterpolatedBetweenUnitVectors) {
  const Eigen::VectorXf expected = (0.75f * (0.5f * cell(2, 3) + 0.5f * cell(3, 3)) +
                                    0.25f * (0.5f * cell(2, 4) + 0.5f * cell(3, 4)))
                                       .normalized();
  EXPECT_LT((sample(8 * 2 + 7.5f, 8 * 3 + 5.5f) - expected).norm(), 1e-5);
}

TEST_F(DescriptorMapTest, IsTheBorderCellBeyondItsCentre) {
  EXPECT_LT((sample(0, 0) - cell(0, 0)).norm(), 1e-5);
  EXPECT_LT((sample(8 * kWidth - 1, 8 * kHeight - 1) - cell(kWidth - 1, kHeight - 1)).norm(), 1e-5);
}

TEST_F(DescriptorMapTest, DoesNotDependOnTheLengthOfTheRawVectors) {
  const Eigen::VectorXf before = sample(20.2f, 11.9f);
  for (float& value : planes_) value *= 50;
  EXPECT_LT((sample(20.2f, 11.9f) - before).norm(), 1e-5);
}

}  // namespace
}  // namespace rover
