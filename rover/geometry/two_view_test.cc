#include "rover/geometry/two_view.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "rover/geometry/two_view_scenes.h"

namespace rover {
namespace {

using namespace two_view_scenes;

constexpr double kDegree = std::numbers::pi / 180;

double rotation_error(const SE3& found, const SE3& truth) {
  return found.rotation.angularDistance(truth.rotation) / kDegree;
}

double direction_error(const SE3& found, const SE3& truth) {
  return angle_between(found.translation, truth.translation) / kDegree;
}

void expect_good(const TwoViewEstimate& estimate, const Scene& scene, double max_degrees) {
  ASSERT_TRUE(estimate.result) << describe(*estimate.failure);
  const TwoViewResult& result = *estimate.result;
  EXPECT_FALSE(estimate.failure);
  EXPECT_NEAR(result.second_from_first.translation.norm(), 1, 1e-12);
  EXPECT_LT(rotation_error(result.second_from_first, scene.second_from_first), 0.3 * max_degrees);
  EXPECT_LT(direction_error(result.second_from_first, scene.second_from_first), max_degrees);
  const int true_pairs = static_cast<int>(scene.pairs.size()) - scene.outliers;
  EXPECT_GT(static_cast<double>(result.inliers.size()), 0.85 * true_pairs);
  ASSERT_EQ(result.points.size(), scene.pairs.size());
  int points = 0, wrong = 0;
  for (std::size_t i = 0; i < scene.pairs.size(); ++i) {
    if (!result.points[i]) continue;
    ++points;
    wrong += static_cast<int>(i) < scene.outliers;
    EXPECT_LT(angle_between(*result.points[i], scene.pairs[i].first), 0.02);
    EXPECT_LT(angle_between(result.second_from_first * *result.points[i], scene.pairs[i].second),
              0.02);
  }
  EXPECT_EQ(points, result.point_count);
  EXPECT_LT(wrong, 0.1 * points);
}

TEST(TwoView, GeneralScenesWithHalfOutliers) {
  Random random(1);
  for (int i = 0; i < 60; ++i) {
    const Scene scene = make_scene(random, random_motion(random, 1), cloud(random),
                                   i % 2 ? kPinhole : kFisheye, 400, 0.5, kSigma);
    const auto estimate = estimate_two_view(scene.pairs, {.ransac = {.seed = 7}});
    expect_good(estimate, scene, 3);
    EXPECT_EQ(estimate.result->model, TwoViewModel::kEssential);
    EXPECT_GT(estimate.result->median_parallax, 3);
  }
}

TEST(TwoView, IsExactWithoutNoise) {
  Random random(2);
  for (int i = 0; i < 60; ++i) {
    const Scene scene = make_scene(random, random_motion(random, 1), cloud(random),
                                   i % 2 ? kPinhole : kFisheye, 100, 0, 0);
    const auto estimate = estimate_two_view(scene.pairs);
    ASSERT_TRUE(estimate.result) << i << describe(*estimate.failure);
    EXPECT_LT(rotation_error(estimate.result->second_from_first, scene.second_from_first), 1e-4);
    EXPECT_LT(direction_error(estimate.result->second_from_first, scene.second_from_first), 1e-3);
  }
}

TEST(TwoView, PlanesGiveAHomography) {
  Random random(3);
  int good = 0, ambiguous = 0;
  constexpr int kRuns = 60;
  for (int i = 0; i < kRuns; ++i) {
    const Eigen::Vector3d normal =
        (Eigen::Vector3d::UnitZ() + 0.3 * random_gaussian_vector(random)).normalized();
    const Scene scene = make_scene(random, sideways(random, 1), plane(normal, 4),
                                   i % 2 ? kPinhole : kFisheye, 400, 0.4, kSigma);
    const auto estimate = estimate_two_view(scene.pairs);
    if (estimate.failure) {
      EXPECT_EQ(*estimate.failure, TwoViewFailure::kAmbiguous) << describe(*estimate.failure);
      ++ambiguous;
      continue;
    }
    EXPECT_EQ(estimate.result->model, TwoViewModel::kHomography);
    expect_good(estimate, scene, 5);
    ++good;
  }
  EXPECT_GT(good, 0.8 * kRuns) << ambiguous << " ambiguous";
}

// Moving towards a wall that fills the view: two planes explain it, so no answer is the answer.
TEST(TwoView, AmbiguousPlanesAreRefusedNotGuessed) {
  Random random(4);
  int ambiguous = 0;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d normal = Eigen::Vector3d(0.5, 0.1 * random.gaussian(), 1).normalized();
    const SE3 motion(random_rotation(random, 0.05),
                     Eigen::Vector3d(0.05 * random.gaussian(), 0.05 * random.gaussian(), -1.5));
    const Scene scene = make_scene(random, motion, plane(normal, 5), {0.4}, 300, 0.2, kSigma);
    const auto estimate = estimate_two_view(scene.pairs);
    if (estimate.result) expect_good(estimate, scene, 6);
    if (estimate.failure == TwoViewFailure::kAmbiguous) ++ambiguous;
  }
  EXPECT_GT(ambiguous, 20);
}

TEST(TwoView, PureRotationIsLowParallax) {
  Random random(5);
  for (int i = 0; i < 60; ++i) {
    const SE3 motion(random_rotation(random, 0.2), Eigen::Vector3d::Zero());
    const Scene scene = make_scene(random, motion, cloud(random), i % 2 ? kPinhole : kFisheye, 300,
                                   0.3 * (i % 3 > 0), i % 5 ? kSigma : 0);
    const auto estimate = estimate_two_view(scene.pairs);
    ASSERT_FALSE(estimate.result);
    EXPECT_EQ(*estimate.failure, TwoViewFailure::kLowParallax) << describe(*estimate.failure);
  }
}

TEST(TwoView, SmallBaselineIsLowParallax) {
  Random random(6);
  for (int i = 0; i < 40; ++i) {
    const Scene scene = make_scene(random, sideways(random, 0.03), cloud(random),
                                   i % 2 ? kPinhole : kFisheye, 300, 0.3, kSigma);
    const auto estimate = estimate_two_view(scene.pairs);
    ASSERT_FALSE(estimate.result);
    EXPECT_EQ(*estimate.failure, TwoViewFailure::kLowParallax) << describe(*estimate.failure);
  }
}

TEST(TwoView, OutliersAloneAreNoModel) {
  Random random(7);
  for (int i = 0; i < 20; ++i) {
    const Scene scene =
        make_scene(random, random_motion(random, 1), cloud(random), kPinhole, 200, 1, kSigma);
    const auto estimate = estimate_two_view(scene.pairs);
    ASSERT_FALSE(estimate.result);
    EXPECT_EQ(*estimate.failure, TwoViewFailure::kNoModel) << describe(*estimate.failure);
  }
}

TEST(TwoView, FewPairsAreRefused) {
  Random random(8);
  const Scene scene =
      make_scene(random, random_motion(random, 1), cloud(random), kPinhole, 49, 0, kSigma);
  EXPECT_EQ(*estimate_two_view(scene.pairs).failure, TwoViewFailure::kTooFewPairs);
  EXPECT_EQ(*estimate_two_view({}).failure, TwoViewFailure::kTooFewPairs);
  EXPECT_TRUE(estimate_two_view(scene.pairs, {.min_points = 30}).result);
}

TEST(TwoView, RepeatsItself) {
  Random random(9);
  const Scene scene =
      make_scene(random, random_motion(random, 1), cloud(random), kPinhole, 200, 0.5, kSigma);
  const auto a = estimate_two_view(scene.pairs), b = estimate_two_view(scene.pairs);
  ASSERT_TRUE(a.result && b.result);
  EXPECT_EQ(a.result->second_from_first.matrix(), b.result->second_from_first.matrix());
  EXPECT_EQ(a.result->inliers, b.result->inliers);
}

TEST(TwoView, OptionsAreChecked) {
  EXPECT_NO_THROW(TwoViewOptions().check());
  EXPECT_THROW(TwoViewOptions{.sigma_px = 0}.check(), InputError);
  EXPECT_THROW(TwoViewOptions{.focal_length = 0}.check(), InputError);
  EXPECT_THROW(TwoViewOptions{.min_points = 0}.check(), InputError);
  EXPECT_THROW(TwoViewOptions{.max_second_share = 1}.check(), InputError);
  EXPECT_THROW(TwoViewOptions{.min_median_parallax = -1}.check(), InputError);
  EXPECT_THROW(TwoViewOptions{.min_point_parallax = -1}.check(), InputError);
}

}  // namespace
}  // namespace rover
