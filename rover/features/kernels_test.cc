#include "rover/features/kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "rover/base/random.h"
#include "rover/features/test_images.h"

namespace rover::kernels {
namespace {

// Every instruction set that this machine has; the baseline always.
class KernelsTest : public ::testing::TestWithParam<InstructionSet> {
 protected:
  void SetUp() override {
    if (!supported(GetParam())) GTEST_SKIP() << "this machine lacks the instructions";
  }
  const Kernels& loops() const { return kernels(GetParam()); }
};
INSTANTIATE_TEST_SUITE_P(, KernelsTest,
                         ::testing::Values(InstructionSet::kBaseline, InstructionSet::kAvx2,
                                           InstructionSet::kAvx512));

std::vector<float> random_values(std::size_t count, double low, double high) {
  Random random(5);
  std::vector<float> values(count);
  for (float& value : values) value = static_cast<float>(random.uniform(low, high));
  return values;
}

double enlarged(const CoarseMap& map, int x, int y) {
  const double u = (x - 3.5) / 8, v = (y - 3.5) / 8;
  const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
  const auto at = [&](int a, int b) {
    return map.data[std::clamp(b, 0, map.height - 1) * map.width + std::clamp(a, 0, map.width - 1)];
  };
  const double s = u - i, t = v - j;
  return (1 - t) * ((1 - s) * at(i, j) + s * at(i + 1, j)) +
         t * ((1 - s) * at(i, j + 1) + s * at(i + 1, j + 1));
}

// The response spelled out in double precision, away from the border.
double plain_response(const cv::Mat& image, int x, int y) {
  const double taps[] = {1, 14, 62, 102, 62, 14, 1};
  const auto smooth = [&](int px, int py) {
    double sum = 0;
    for (int j = -3; j <= 3; ++j) {
      for (int i = -3; i <= 3; ++i) {
        sum += taps[j + 3] * taps[i + 3] * image.at<std::uint8_t>(py + j, px + i);
      }
    }
    return sum / 65536;
  };
  double xx = 0, xy = 0, yy = 0;
  for (int j = y - 2; j <= y + 2; ++j) {
    for (int i = x - 2; i <= x + 2; ++i) {
      const double gx = (smooth(i + 1, j) - smooth(i - 1, j)) / 2;
      const double gy = (smooth(i, j + 1) - smooth(i, j - 1)) / 2;
      xx += gx * gx / 25;
      xy += gx * gy / 25;
      yy += gy * gy / 25;
    }
  }
  return std::sqrt(std::max(0.0, (xx + yy) / 2 - std::hypot((xx - yy) / 2, xy)));
}

struct Response {
  Response(const Kernels& loops, const cv::Mat& image, const CoarseMap& weight,
           std::vector<int> stripes)
      : values(image.total()) {
    std::vector<float> scratch(corner_scratch_size(image.cols));
    const ImageView view{image.data, static_cast<std::ptrdiff_t>(image.step), image.cols,
                         image.rows};
    for (std::size_t i = 0; i + 1 < stripes.size(); ++i) {
      loops.corner_response(view, weight, stripes[i], stripes[i + 1], values.data(),
                            scratch.data());
    }
  }
  std::vector<float> values;
};

TEST_P(KernelsTest, CornerResponseIsThatOfTheDefinition) {
  const cv::Mat image = testing::textured_image(151, 97);
  const auto reliability = random_values(20 * 16, 0, 1);
  const CoarseMap weight{reliability.data(), 20, 16};
  const Response response(loops(), image, weight, {0, 97});
  for (int y = 6; y < 91; ++y) {
    for (int x = 6; x < 145; ++x) {
      const double expected = plain_response(image, x, y) * enlarged(weight, x, y);
      ASSERT_NEAR(response.values[y * 151 + x], expected, 2e-3 + 1e-3 * expected) << x << " " << y;
    }
  }
}

TEST_P(KernelsTest, CornerResponseDoesNotDependOnTheStripes) {
  const cv::Mat image = testing::textured_image(100, 64);
  const auto reliability = random_values(16 * 8, 0, 1);
  const CoarseMap weight{reliability.data(), 16, 8};
  const Response whole(loops(), image, weight, {0, 64});
  const Response striped(loops(), image, weight, {0, 1, 33, 60, 64});
  EXPECT_EQ(whole.values, striped.values);
}

TEST_P(KernelsTest, CornerResponseOfOneGrayIsZero) {
  const cv::Mat image(64, 64, CV_8UC1, cv::Scalar(77));
  const std::vector<float> reliability(64, 1.0f);
  const Response response(loops(), image, {reliability.data(), 8, 8}, {0, 64});
  EXPECT_EQ(*std::ranges::max_element(response.values), 0);
}

TEST_P(KernelsTest, AgreesWithTheBaseline) {
  const cv::Mat image = testing::textured_image(203, 64);
  const auto reliability = random_values(28 * 8, 0, 1);
  const CoarseMap weight{reliability.data(), 28, 8};
  const Response own(loops(), image, weight, {0, 64});
  const Response baseline(kernels(InstructionSet::kBaseline), image, weight, {0, 64});
  for (std::size_t i = 0; i < own.values.size(); ++i) {
    ASSERT_NEAR(own.values[i], baseline.values[i], 2e-3f + 1e-3f * baseline.values[i]);
  }
}

TEST_P(KernelsTest, ConvertsAndPadsRows) {
  const std::vector<std::uint8_t> bytes = {0, 51, 255};
  std::vector<float> out(5);
  loops().to_float(bytes.data(), 3, 1.0f / 255, out.data(), 5);
  const std::vector<float> expected = {0, 0.2f, 1, 1, 1};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(out[i], expected[i], 1e-6);
}

TEST_P(KernelsTest, NormalizesCells) {
  constexpr int kChannels = 64, kCells = 37;
  const auto planes = random_values(kChannels * kCells, -2, 3);
  std::vector<float> out(kChannels * kCells, -9.0f);
  loops().normalize_cells(planes.data(), kChannels, kCells, 2, kCells, out.data());
  EXPECT_EQ(out[kChannels], -9.0f) << "cells before the first one are not touched";
  for (int cell = 2; cell < kCells; ++cell) {
    double norm = 0;
    for (int c = 0; c < kChannels; ++c) norm += std::pow(planes[c * kCells + cell], 2);
    for (int c = 0; c < kChannels; ++c) {
      ASSERT_NEAR(out[cell * kChannels + c], planes[c * kCells + cell] / std::sqrt(norm), 1e-5);
    }
  }
}

TEST_P(KernelsTest, BlendsAndNormalizesVectors) {
  const auto a = random_values(48, -1, 1), b = random_values(96, -1, 1);
  const float* vectors[] = {a.data(), b.data() + 48};
  const float weights[] = {0.25f, 2};
  std::vector<float> out(48);
  loops().blend(vectors, weights, 2, 48, out.data());
  double square = 0;
  for (std::size_t i = 0; i < 48; ++i) {
    ASSERT_NEAR(out[i], 0.25 * a[i] + 2 * b[48 + i], 1e-5);
    square += out[i] * out[i];
  }
  const auto blended = out;
  loops().normalize(out.data(), 48);
  for (std::size_t i = 0; i < 48; ++i) ASSERT_NEAR(out[i], blended[i] / std::sqrt(square), 1e-5);
}

TEST_P(KernelsTest, ZeroStaysZeroWhenNormalized) {
  std::vector<float> zeros(32, 0.0f);
  loops().normalize(zeros.data(), 32);
  for (const float value : zeros) EXPECT_EQ(value, 0);
}

TEST_P(KernelsTest, SoftmaxIsThatOfTheDefinition) {
  constexpr int kCellsX = 9, kCellsY = 4, kPlane = kCellsX * kCellsY;
  auto logits = random_values(65 * kPlane, -8, 8);
  logits[64 * kPlane] = 300;     // far apart: all but one are zero
  logits[10 * kPlane + 1] = 40;  // one pixel takes all
  std::vector<float> heat(64 * kPlane), scratch(66 * kCellsX);
  loops().softmax_cells(logits.data(), kCellsX, kCellsY, 0, kCellsY, heat.data(), scratch.data());
  for (int cell = 0; cell < kPlane; ++cell) {
    double largest = -1e9, sum = 0;
    for (int c = 0; c < 65; ++c) largest = std::max<double>(largest, logits[c * kPlane + cell]);
    for (int c = 0; c < 65; ++c) sum += std::exp(logits[c * kPlane + cell] - largest);
    for (int c = 0; c < 64; ++c) {
      const int x = cell % kCellsX * 8 + c % 8, y = cell / kCellsX * 8 + c / 8;
      const double expected = std::exp(logits[c * kPlane + cell] - largest) / sum;
      ASSERT_NEAR(heat[y * kCellsX * 8 + x], expected, 1e-6 + 1e-5 * expected);
    }
  }
}

TEST(BestKernels, AreSupported) {
  EXPECT_TRUE(supported(InstructionSet::kBaseline));
  int matching = 0;
  for (const auto set :
       {InstructionSet::kBaseline, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
    matching += supported(set) && &kernels(set) == &best_kernels();
  }
  EXPECT_EQ(matching, 1);
}

}  // namespace
}  // namespace rover::kernels
