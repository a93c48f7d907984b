#include "rover/geometry/ransac.h"

#include <cmath>
#include <numeric>
#include <set>

#include <gtest/gtest.h>

namespace rover {
namespace {

// The mean of one-dimensional data: small enough to know every answer.
struct MeanProblem {
  using Model = double;
  static constexpr int kSampleSize = 1;
  std::vector<double> data;

  int size() const { return static_cast<int>(data.size()); }
  std::array<int, 1> sample(Random& random) const { return draw_sample<1>(size(), random); }
  std::vector<double> solve(const std::array<int, 1>& sample) const { return {data[sample[0]]}; }
  double squared_error(double model, int i) const { return (data[i] - model) * (data[i] - model); }
  double threshold() const { return 1; }
  double refine(double, const std::vector<int>& inliers) const {
    double sum = 0;
    for (const int i : inliers) sum += data[i];
    return sum / static_cast<double>(inliers.size());
  }
};

MeanProblem noisy_data(int inliers, int outliers) {
  Random random(5);
  MeanProblem problem;
  for (int i = 0; i < inliers; ++i) problem.data.push_back(7 + 0.2 * random.gaussian());
  for (int i = 0; i < outliers; ++i) problem.data.push_back(random.uniform(-1000, 1000));
  return problem;
}

TEST(Ransac, FindsTheModelOfTheMinority) {
  const MeanProblem problem = noisy_data(200, 800);
  const auto result = ransac(problem, {.seed = 3});
  ASSERT_TRUE(result);
  EXPECT_NEAR(result->model, 7, 0.05);
  EXPECT_GE(result->inliers.size(), 200u);
  EXPECT_TRUE(std::is_sorted(result->inliers.begin(), result->inliers.end()));
}

TEST(Ransac, CostIsTheTruncatedSum) {
  const MeanProblem problem = noisy_data(50, 50);
  const auto result = ransac(problem, {});
  double cost = 0;
  for (const double x : problem.data) cost += std::min(1.0, std::pow(x - result->model, 2));
  EXPECT_NEAR(result->cost, cost, 1e-9);
}

TEST(Ransac, RepeatsItself) {
  const MeanProblem problem = noisy_data(30, 70);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto a = ransac(problem, {.seed = seed}), b = ransac(problem, {.seed = seed});
    EXPECT_EQ(a->model, b->model);
    EXPECT_EQ(a->inliers, b->inliers);
    EXPECT_EQ(a->iterations, b->iterations);
  }
}

TEST(Ransac, NeedsFewerIterationsForCleanerData) {
  const auto clean = ransac(noisy_data(100, 0), {.min_iterations = 1});
  const auto dirty = ransac(noisy_data(10, 90), {.min_iterations = 1});
  EXPECT_EQ(clean->iterations, 1);
  EXPECT_GT(dirty->iterations, 50);
  EXPECT_EQ(ransac(noisy_data(1, 999), {.max_iterations = 40})->iterations, 40);
}

TEST(Ransac, IterationsFollowTheBinomialLaw) {
  EXPECT_EQ(ransac_iterations(1, 5, 0.99), 1);
  EXPECT_TRUE(std::isinf(ransac_iterations(0, 5, 0.99)));
  EXPECT_NEAR(ransac_iterations(0.5, 5, 0.99), 145.05, 0.01);
}

TEST(Ransac, SamplesAreDistinctAndReachEverything) {
  Random random(9);
  std::set<int> seen;
  for (int i = 0; i < 3000; ++i) {
    const auto sample = draw_sample<5>(5 + i % 40, random);
    EXPECT_EQ(std::set<int>(sample.begin(), sample.end()).size(), 5u);
    seen.insert(sample.begin(), sample.end());
  }
  EXPECT_EQ(seen.size(), 44u);
  EXPECT_EQ(*seen.begin(), 0);
}

TEST(Ransac, OptionsAreChecked) {
  EXPECT_NO_THROW(RansacOptions().check());
  EXPECT_THROW(RansacOptions{.confidence = 1}.check(), InputError);
  EXPECT_THROW(RansacOptions{.min_iterations = 0}.check(), InputError);
  EXPECT_THROW((RansacOptions{.min_iterations = 9, .max_iterations = 8}.check()), InputError);
}

}  // namespace
}  // namespace rover
