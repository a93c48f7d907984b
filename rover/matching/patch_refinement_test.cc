#include "rover/matching/patch_refinement.h"

#include <numeric>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "rover/base/error.h"
#include "rover/matching/test_images.h"

namespace rover {
namespace {

const cv::Size kImage(64, 64);
const Eigen::Vector2d kCentre(32, 32);
const PatchRefinementOptions kFarOptions{.max_shift = 3.0f};

Eigen::Vector2d identity(const Eigen::Vector2d& p) { return p; }

ReferencePatch reference_patch(const SmoothTexture& texture, double noise = 0,
                               std::uint64_t seed = 7) {
  Random random(seed);  // features lie anywhere between pixels
  const Eigen::Vector2d at = kCentre + Eigen::Vector2d(random.uniform(), random.uniform());
  const auto shifted = [&](const Eigen::Vector2d& p) { return Eigen::Vector2d(p - at + kCentre); };
  return cut_patch(texture.render(kImage, shifted, 1, 0, noise, seed), at.cast<float>()).value();
}

TEST(CutPatch, InterpolatesAndRefusesTheBorder) {
  cv::Mat ramp(40, 40, CV_8UC1);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) ramp.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(4 * x + y);
  }
  const auto patch = cut_patch(ramp, {20.5f, 19.0f});
  ASSERT_TRUE(patch);
  const int centre = ReferencePatch::kSize / 2;
  EXPECT_EQ(patch->pixels[centre * ReferencePatch::kSize + centre], 4 * 20 + 2 + 19);
  EXPECT_TRUE(cut_patch(ramp, {12, 12}));
  EXPECT_TRUE(cut_patch(ramp, {26.9f, 26.9f}));
  EXPECT_FALSE(cut_patch(ramp, {11.9f, 20}));
  EXPECT_FALSE(cut_patch(ramp, {20, 27.5f}));
  EXPECT_FALSE(cut_patch(ramp, {std::nanf(""), 20}));
}

TEST(RefinePosition, FindsSubPixelShifts) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const SmoothTexture texture(seed, 6, 30, 30);
    const auto patch = reference_patch(texture);
    Random random(seed);
    const Eigen::Vector2d shift(random.uniform(-1, 1), random.uniform(-1, 1));
    const cv::Mat image = texture.render(
        kImage, [&](const Eigen::Vector2d& p) { return Eigen::Vector2d(p - shift); });
    const auto found = refine_position(patch, image, kCentre.cast<float>(),
                                       Eigen::Matrix2f::Identity(), kFarOptions);
    ASSERT_TRUE(found) << seed;
    EXPECT_LT((found->position.cast<double>() - kCentre - shift).norm(), 0.05) << seed;
    EXPECT_GT(found->correlation, 0.98f);
    EXPECT_LE(found->correlation, 1.0f);
    EXPECT_GE(found->sigma, PatchRefinementOptions{}.min_sigma);
  }
}

TEST(RefinePosition, FollowsWarpAndIllumination) {
  Eigen::Matrix2d warp;  // image_from_patch: scale 1.2, turned by 15 degrees, sheared
  warp << 1.16, -0.31, 0.38, 1.10;
  const Eigen::Matrix2d inverse = warp.inverse();
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const SmoothTexture texture(seed, 8, 20, 30);
    const Eigen::Vector2d centre(32.3, 31.6);
    const cv::Mat image = texture.render(
        kImage,
        [&](const Eigen::Vector2d& p) { return Eigen::Vector2d(kCentre + inverse * (p - centre)); },
        0.6, 30);
    const auto found = refine_position(reference_patch(texture), image, kCentre.cast<float>(),
                                       warp.cast<float>(), {});
    ASSERT_TRUE(found) << seed;
    const double error = (found->position.cast<double>() - centre).norm();
    EXPECT_LT(error, std::max(0.05, 3.5 * found->sigma)) << seed;
    EXPECT_LT(found->sigma, 0.15f) << seed;
  }
}

// The point of a reported sigma: error / sigma has variance 1, whatever noise and texture.
TEST(RefinePosition, SigmaIsHonest) {
  PatchRefinementOptions options;
  options.min_sigma = 1e-4f;
  options.min_correlation = 0.3f;
  for (const auto& [noise, contrast] : {std::pair(3.0, 20.0), {6.0, 30.0}, {10.0, 30.0}}) {
    double square = 0;
    int count = 0;
    for (std::uint64_t seed = 1; seed <= 300; ++seed) {
      const SmoothTexture texture(seed, 6, 25, contrast);
      Random random(seed + 1000);
      const Eigen::Vector2d shift(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5));
      const cv::Mat image = texture.render(
          kImage, [&](const Eigen::Vector2d& p) { return Eigen::Vector2d(p - shift); }, 1, 0, noise,
          2 * seed);
      const auto found =
          refine_position(reference_patch(texture, noise, 2 * seed + 1), image,
                          kCentre.cast<float>(), Eigen::Matrix2f::Identity(), options);
      if (!found) continue;
      square += (found->position.cast<double>() - kCentre - shift).squaredNorm() /
                (found->sigma * found->sigma) / 2;
      ++count;
    }
    EXPECT_GT(count, 285);
    EXPECT_NEAR(square / count, 1.0, 0.35) << "noise " << noise << ", contrast " << contrast;
  }
}

TEST(RefinePosition, RefusesFlatPatchesEdgesAndStrangers) {
  const PatchRefinementOptions options;
  const SmoothTexture flat(1, 6, 30, 0);
  const cv::Mat flat_image = flat.render(kImage, identity, 1, 0, 2, 3);
  EXPECT_FALSE(refine_position(reference_patch(flat, 2), flat_image, kCentre.cast<float>(),
                               Eigen::Matrix2f::Identity(), options));

  cv::Mat edge(kImage, CV_8UC1, cv::Scalar(50));
  edge.colRange(32, 64) = 200;
  EXPECT_FALSE(refine_position(cut_patch(edge, {32, 32}).value(), edge, {32, 32},
                               Eigen::Matrix2f::Identity(), options));

  int accepted = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const cv::Mat other = SmoothTexture(seed + 100).render(kImage, identity);
    if (refine_position(reference_patch(SmoothTexture(seed)), other, kCentre.cast<float>(),
                        Eigen::Matrix2f::Identity(), options)) {
      ++accepted;
    }
  }
  EXPECT_LE(accepted, 1);
}

TEST(RefinePosition, RefusesTheBorderExtremeWarpsAndWhatIsNotANumber) {
  const SmoothTexture texture(1);
  const cv::Mat image = texture.render(kImage, identity);
  const auto patch = reference_patch(texture);
  const Eigen::Matrix2f same = Eigen::Matrix2f::Identity();
  for (const Eigen::Vector2f& at : {Eigen::Vector2f(3, 32),
                                    {32, 3},
                                    {61, 32},
                                    {32, 61},
                                    {-5, 32},
                                    {32, 500},
                                    {std::nanf(""), 32}}) {
    EXPECT_FALSE(refine_position(patch, image, at, same, {}));
  }
  EXPECT_FALSE(refine_position(patch, image, {32, 32}, 0.3f * same, {}));  // leaves the patch
  EXPECT_FALSE(refine_position(patch, image, {32, 32}, 0 * same, {}));
}

TEST(RefinePosition, WorksUpToTheBorder) {
  const SmoothTexture texture(5, 6, 30, 30);
  const Eigen::Vector2d centre(57.6, 57.4);
  const cv::Mat image = texture.render(
      kImage, [&](const Eigen::Vector2d& p) { return Eigen::Vector2d(p - centre + kCentre); });
  const auto found = refine_position(reference_patch(texture), image, {57.2f, 57.1f},
                                     Eigen::Matrix2f::Identity(), {});
  ASSERT_TRUE(found);
  EXPECT_LT((found->position.cast<double>() - centre).norm(), 0.05);
}

TEST(RefinePosition, StaysWithinMaxShift) {
  const SmoothTexture texture(4, 12, 40);
  const cv::Mat image = texture.render(
      kImage, [](const Eigen::Vector2d& p) { return Eigen::Vector2d(p - Eigen::Vector2d(2, 0)); });
  PatchRefinementOptions options = kFarOptions;
  const auto found = refine_position(reference_patch(texture), image, kCentre.cast<float>(),
                                     Eigen::Matrix2f::Identity(), options);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->position.x(), 34, 0.1);
  options.max_shift = 1.5f;
  EXPECT_FALSE(refine_position(reference_patch(texture), image, kCentre.cast<float>(),
                               Eigen::Matrix2f::Identity(), options));
}

TEST(PatchRefinementOptions, ChecksItself) {
  EXPECT_NO_THROW(PatchRefinementOptions{}.check());
  PatchRefinementOptions options;
  options.half_window = 8;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.max_sigma = 0;
  EXPECT_THROW(options.check(), InputError);
}

}  // namespace
}  // namespace rover
