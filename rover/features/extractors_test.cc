// What every extractor promises (extractor.h, feature_set.h), and what is particular to some.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "rover/base/error.h"
#include "rover/features/extractor_factory.h"
#include "rover/features/image_input.h"
#include "rover/features/test_images.h"

namespace rover {
namespace {

using testing::real_images;
using testing::textured_image;

class ExtractorTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    try {
      extractor_ = make_extractor(GetParam(), runtime_);
    } catch (const InputError& error) {
      GTEST_SKIP() << error.what();
    }
  }

  FeatureSet extract(const cv::Mat& image, int budget = 300) const {
    ExtractionRequest request;
    request.budget = budget;
    return extractor_->extract(image, request);
  }

  Runtime runtime_{RuntimeOptions{}};
  std::unique_ptr<Extractor> extractor_;
};

INSTANTIATE_TEST_SUITE_P(, ExtractorTest, ::testing::ValuesIn(extractor_names()),
                         [](const auto& instance) {
                           std::string name = instance.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

void expect_sound(const FeatureSet& features, const cv::Mat& image, int descriptor_size) {
  EXPECT_EQ(features.image_size, image.size());
  const auto count = features.positions.size();
  ASSERT_EQ(features.scores.size(), count);
  ASSERT_EQ(features.sigmas.size(), count);
  ASSERT_EQ(features.descriptors.rows(), features.size());
  ASSERT_EQ(features.descriptors.cols(), descriptor_size);
  EXPECT_GE(features.candidates, features.size());
  EXPECT_TRUE(std::ranges::is_sorted(features.scores, std::greater<>()));
  for (int i = 0; i < features.size(); ++i) {
    const auto& p = features.positions[i];
    EXPECT_TRUE(p.x() > 2 && p.y() > 2 && p.x() < static_cast<float>(image.cols - 3) &&
                p.y() < static_cast<float>(image.rows - 3))
        << p.transpose();
    EXPECT_NEAR(features.descriptors.row(i).norm(), 1, 1e-4);
    EXPECT_TRUE(features.sigmas[i] > 0.05f && features.sigmas[i] < 3) << features.sigmas[i];
  }
}

void expect_same(const FeatureSet& a, const FeatureSet& b) {
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.scores, b.scores);
  EXPECT_EQ(a.sigmas, b.sigmas);
  EXPECT_TRUE(a.descriptors == b.descriptors);
  EXPECT_EQ(a.threshold, b.threshold);
}

// Share of a's positions that b has within so many pixels.
double share_found(const FeatureSet& a, const FeatureSet& b, float pixels) {
  int found = 0;
  for (const auto& p : a.positions) {
    found +=
        std::ranges::any_of(b.positions, [&](const auto& q) { return (p - q).norm() < pixels; });
  }
  return found / static_cast<double>(a.size());
}

TEST_P(ExtractorTest, KeepsItsPromisesOnTexture) {
  const cv::Mat image = textured_image(333, 245);
  const auto features = extract(image, 100);
  EXPECT_GT(features.size(), 50);
  EXPECT_LE(features.size(), 100);
  expect_sound(features, image, extractor_->descriptor_size());
}

TEST_P(ExtractorTest, KeepsItsPromisesOnRealImages) {
  const auto images = real_images();
  if (images.empty()) GTEST_SKIP() << "../shared/data is absent";
  for (const auto& [name, image] : images) {
    const auto features = extract(image, 800);
    EXPECT_GT(features.size(), 250) << name;
    EXPECT_LE(features.size(), 800) << name;
    expect_sound(features, image, extractor_->descriptor_size());
  }
}

TEST_P(ExtractorTest, RepeatsItselfFromSeveralThreads) {
  const cv::Mat image = textured_image(256, 192);
  const auto expected = extract(image);
  expect_same(extract(image), expected);
  std::vector<std::jthread> threads;
  for (int i = 0; i < 2; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < 2; ++k) expect_same(extract(image), expected);
    });
  }
}

TEST_P(ExtractorTest, FindsHardlyAnythingInOneGray) {
  for (const int gray : {0, 128, 255}) {
    const cv::Mat image(128, 160, CV_8UC1, cv::Scalar(gray));
    const auto features = extract(image);
    EXPECT_LE(features.size(), 10);
    expect_sound(features, image, extractor_->descriptor_size());
  }
}

TEST_P(ExtractorTest, ObeysTheMask) {
  const cv::Mat image = textured_image(320, 224);
  cv::Mat mask = cv::Mat::zeros(image.size(), CV_8UC1);
  mask(cv::Rect(100, 0, 220, 224)) = 255;
  ExtractionRequest request;
  request.mask = &mask;
  const auto features = extractor_->extract(image, request);
  EXPECT_GT(features.size(), 30);
  for (const auto& p : features.positions) EXPECT_GT(p.x(), 98);
  mask = 0;
  EXPECT_TRUE(extractor_->extract(image, request).empty());
}

TEST_P(ExtractorTest, ObeysAGivenThreshold) {
  const cv::Mat image = textured_image(320, 224);
  const auto free = extract(image, 100000);
  ExtractionRequest request;
  request.threshold = free.scores[free.scores.size() / 3];
  const auto bound = extractor_->extract(image, request);
  EXPECT_EQ(bound.threshold, *request.threshold);
}

TEST_P(ExtractorTest, TakesImagesOfAnySizeFrom32) {
  for (const auto& [width, height] : {std::pair{32, 32}, {33, 65}, {97, 40}}) {
    const cv::Mat image = textured_image(width, height);
    expect_sound(extract(image), image, extractor_->descriptor_size());
  }
}

TEST_P(ExtractorTest, TakesPartsOfImages) {
  const cv::Mat image = textured_image(400, 300);
  const cv::Mat part = image(cv::Rect(37, 21, 256, 192));
  expect_same(extract(part), extract(part.clone()));
}

TEST_P(ExtractorTest, RefusesWhatIsNoGrayImage) {
  EXPECT_THROW(extract(cv::Mat()), InputError);
  EXPECT_THROW(extract(cv::Mat::zeros(100, 16, CV_8UC1)), InputError);
  EXPECT_THROW(extract(cv::Mat::zeros(100, 100, CV_8UC3)), InputError);
}

// Positions follow the picture when it is shifted by a whole number of cells.
TEST_P(ExtractorTest, FollowsAShift) {
  const cv::Mat image = textured_image(416, 320);
  auto a = extract(image(cv::Rect(0, 0, 384, 288)), 500);
  const auto b = extract(image(cv::Rect(32, 32, 384, 288)), 500);
  std::erase_if(a.positions, [](const auto& p) { return p.x() < 80 || p.y() < 80; });
  for (auto& p : a.positions) p -= Eigen::Vector2f(32, 32);
  EXPECT_GT(share_found(a, b, 1.0f), 0.6);
}

long resident_kilobytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word == "VmRSS:") break;
  }
  long kilobytes = 0;
  status >> kilobytes;
  return kilobytes;
}

TEST_P(ExtractorTest, KeepsItsMemoryOver200Frames) {
  std::vector<cv::Mat> images;
  for (std::uint64_t i = 0; i < 4; ++i)
    images.push_back(textured_image(128 + 16 * static_cast<int>(i), 96, i));
  for (const auto& image : images) extract(image);
  const long before = resident_kilobytes();
  for (std::size_t i = 0; i < 200; ++i) extract(images[i % images.size()]);
  EXPECT_LT(resident_kilobytes() - before, 8 * 1024);
}

TEST(ExtractorFactory, NamesWhatItKnows) {
  Runtime runtime({});
  try {
    make_extractor("surf", runtime);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::AllOf(::testing::HasSubstr("surf"),
                                               ::testing::HasSubstr("xfeat-corner")));
  }
  EXPECT_EQ(extractor_names().size(), 6u);
}

#define EXTRACTOR_OR_SKIP(name, ...)                          \
  std::unique_ptr<Extractor> extractor;                       \
  try {                                                       \
    extractor = make_extractor(name, runtime, ##__VA_ARGS__); \
  } catch (const InputError& error) {                         \
    GTEST_SKIP() << error.what();                             \
  }

TEST(XFeatCorner, FindsTheCornersOfASquareToAPixelFraction) {
  Runtime runtime({});
  EXTRACTOR_OR_SKIP("xfeat-corner");
  // Drawn four times as large and reduced, so that edges lie at 39.5 and 79.5 without jags.
  cv::Mat large(4 * 128, 4 * 128, CV_8UC1, cv::Scalar(60)), image;
  large(cv::Rect(160, 160, 160, 160)) = 200;
  cv::resize(large, image, {128, 128}, 0, 0, cv::INTER_AREA);
  const auto features = extractor->extract(image, {});
  ASSERT_GE(features.size(), 4);
  // The response peaks inside the corner, as far in each corner: the centre is exact.
  Eigen::Vector2f sum(0, 0);
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2f fromCentre = features.positions[i] - Eigen::Vector2f(59.5f, 59.5f);
    EXPECT_NEAR(std::abs(fromCentre.x()), 19, 1.5);
    EXPECT_NEAR(std::abs(fromCentre.y()), 19, 1.5);
    sum += fromCentre;
  }
  EXPECT_LT(sum.norm() / 4, 0.2);
}

TEST(XFeatCorner, BaselineFindsTheSameFeatures) {
  Runtime runtime({});
  ExtractorOptions options;
  options.kernels = &kernels::kernels(kernels::InstructionSet::kBaseline);
  EXTRACTOR_OR_SKIP("xfeat-corner", options);
  const auto best = make_extractor("xfeat-corner", runtime);
  const cv::Mat image = textured_image(320, 256);
  const auto a = extractor->extract(image, {}), b = best->extract(image, {});
  EXPECT_NEAR(a.size(), b.size(), 3);
  EXPECT_GT(share_found(a, b, 0.1f), 0.98);
}

TEST(XFeatCorner, TakesMoreWhenTheTrackerIsInNeed) {
  Runtime runtime({});
  ExtractorOptions options;
  options.min_features = 0;
  options.mu1 = 1.0f;
  EXTRACTOR_OR_SKIP("xfeat-corner", options);
  const cv::Mat image = textured_image(640, 480);
  ExtractionRequest request;
  request.budget = 10000;
  const auto lost = extractor->extract(image, request);
  request.last_matches = 500;
  const auto tracked = extractor->extract(image, request);
  EXPECT_GT(lost.size(), tracked.size());
  EXPECT_LT(lost.threshold, tracked.threshold);
}

TEST(Orb, MakesUnitVectorsOfItsBits) {
  Runtime runtime({});
  const auto orb = make_extractor("orb", runtime);
  const auto features = orb->extract(textured_image(320, 240), {});
  ASSERT_GT(features.size(), 100);
  EXPECT_TRUE((features.descriptors.array().abs() == 1.0f / 16).all());
  EXPECT_GT(*std::ranges::max_element(features.sigmas),
            1.5f * *std::ranges::min_element(features.sigmas))
      << "coarser levels are less certain";
}

}  // namespace
}  // namespace rover
