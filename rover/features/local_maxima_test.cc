#include "rover/features/local_maxima.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "rover/base/error.h"
#include "rover/base/random.h"
#include "rover/features/heatmap.h"

namespace rover {
namespace {

constexpr int kWidth = 75, kHeight = 52, kStride = 80;

std::vector<float> random_map(std::uint64_t seed) {
  Random random(seed);
  std::vector<float> values(kStride * kHeight);
  for (float& value : values) value = static_cast<float>(random.uniform(-1, 1));
  return values;
}

ScoreMap view_of(const std::vector<float>& values) {
  return {values.data(), kStride, kWidth, kHeight};
}

bool is_maximum(const ScoreMap& map, int x, int y, int radius) {
  for (int j = std::max(0, y - radius); j <= std::min(kHeight - 1, y + radius); ++j) {
    for (int i = std::max(0, x - radius); i <= std::min(kWidth - 1, x + radius); ++i) {
      if (*map.at(i, j) > *map.at(x, y)) return false;
    }
  }
  return true;
}

std::vector<std::pair<int, int>> brute_force(const ScoreMap& map, const MaximaOptions& options) {
  std::vector<std::pair<int, int>> found;
  for (int y = options.border; y < kHeight - options.border; ++y) {
    for (int x = options.border; x < kWidth - options.border; ++x) {
      if (*map.at(x, y) > options.floor && is_maximum(map, x, y, options.radius)) {
        found.emplace_back(x, y);
      }
    }
  }
  return found;
}

std::vector<std::pair<int, int>> positions_of(const std::vector<Candidate>& candidates) {
  std::vector<std::pair<int, int>> positions;
  for (const auto& c : candidates) positions.emplace_back(c.x, c.y);
  return positions;
}

TEST(LocalMaxima, AreThoseOfTheDefinitionOnAnyMachine) {
  const auto values = random_map(1);
  const ScoreMap map = view_of(values);
  std::vector<float> scratch;
  for (const auto set : {kernels::InstructionSet::kBaseline, kernels::InstructionSet::kAvx2,
                         kernels::InstructionSet::kAvx512}) {
    if (!kernels::supported(set)) continue;
    for (const int threads : {1, 2, 3}) {
      ThreadPool pool(threads);
      for (const int radius : {1, 2, 3, 4, 6, 30}) {
        const MaximaOptions options{.radius = radius, .border = radius % 3 + 1, .floor = -0.2f};
        const auto found =
            find_local_maxima(map, options, nullptr, kernels::kernels(set), pool, scratch);
        EXPECT_EQ(positions_of(found), brute_force(map, options)) << radius;
        for (const auto& c : found) EXPECT_EQ(c.score, *map.at(c.x, c.y));
      }
    }
  }
}

TEST(LocalMaxima, LeaveOutWhatIsMaskedOrSmall) {
  const auto values = random_map(2);
  ThreadPool pool(2);
  std::vector<float> scratch;
  cv::Mat mask(kHeight, kWidth, CV_8UC1, cv::Scalar(255));
  mask(cv::Rect(0, 0, 40, kHeight)) = 0;
  const auto found = find_local_maxima(view_of(values), {.radius = 2, .border = 1}, &mask,
                                       kernels::best_kernels(), pool, scratch);
  ASSERT_FALSE(found.empty());
  for (const auto& c : found) EXPECT_GE(c.x, 40);
  EXPECT_TRUE(find_local_maxima(view_of(values), {.radius = 2, .border = 1, .floor = 1}, nullptr,
                                kernels::best_kernels(), pool, scratch)
                  .empty());
  EXPECT_TRUE(find_local_maxima(view_of(values), {.radius = 2, .border = 40}, nullptr,
                                kernels::best_kernels(), pool, scratch)
                  .empty());
}

TEST(LocalMaxima, RefuseOptionsThatMakeNoSense) {
  EXPECT_NO_THROW(MaximaOptions{}.check());
  EXPECT_THROW((MaximaOptions{.radius = 0}.check()), InputError);
  EXPECT_THROW((MaximaOptions{.border = 0}.check()), InputError);
}

TEST(ParabolaOffset, IsExactOnParabolas) {
  for (const float vertex : {-0.5f, -0.2f, 0.0f, 0.4f}) {
    const auto at = [&](float x) { return 7 - 3 * (x - vertex) * (x - vertex); };
    EXPECT_NEAR(parabola_offset(at(-1), at(0), at(1)), vertex, 1e-6);
  }
  EXPECT_EQ(parabola_offset(1, 1, 1), 0);
}

TEST(Refinement, FindsTheVertexOfATiltedQuadratic) {
  const float x0 = 20.3f, y0 = 15.6f;
  std::vector<float> straight(kStride * kHeight), tilted = straight;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const float dx = static_cast<float>(x) - x0, dy = static_cast<float>(y) - y0;
      straight[y * kStride + x] = 9 - dx * dx - 2 * dy * dy;
      tilted[y * kStride + x] = 9 - dx * dx - 2 * dy * dy + 1.5f * dx * dy;
    }
  }
  const Candidate candidate{20, 16, 0};
  const Eigen::Vector2f vertex(x0, y0);
  EXPECT_LT((refine_parabola(view_of(straight), candidate) - vertex).norm(), 1e-3);
  EXPECT_LT((refine_quadratic(view_of(straight), candidate) - vertex).norm(), 1e-3);
  EXPECT_LT((refine_quadratic(view_of(tilted), candidate) - vertex).norm(), 1e-3);
}

TEST(Refinement, StaysAtTheWholePixelWithoutAVertex) {
  const std::vector<float> flat(kStride * kHeight, 1.0f);
  EXPECT_EQ(refine_quadratic(view_of(flat), {10, 12, 1}), Eigen::Vector2f(10, 12));
  EXPECT_EQ(refine_parabola(view_of(flat), {10, 12, 1}), Eigen::Vector2f(10, 12));
  EXPECT_LT((refine_centroid(view_of(flat), {10, 12, 1}, 2) - Eigen::Vector2f(10, 12)).norm(),
            1e-5);
}

TEST(Refinement, CentroidIsThatOfTheMass) {
  std::vector<float> values(kStride * kHeight, 0.0f);
  values[12 * kStride + 10] = 3;
  values[13 * kStride + 12] = 1;
  EXPECT_LT(
      (refine_centroid(view_of(values), {10, 12, 3}, 2) - Eigen::Vector2f(10.5f, 12.25f)).norm(),
      1e-5);
}

}  // namespace
}  // namespace rover
