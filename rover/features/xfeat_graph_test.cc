// The 8-bit XFeat must give what the one in floats gives.

#include "rover/features/xfeat_graph.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "rover/base/error.h"
#include "rover/features/extractor_factory.h"
#include "rover/features/test_images.h"

namespace rover {
namespace {

TEST(XFeatGraph, IsFloatOnAccelerators) {
  EXPECT_EQ(xfeat_graph(Precision::kAutomatic, Device::kCuda), "xfeat.onnx");
  EXPECT_EQ(xfeat_graph(Precision::kFloat, Device::kCpu), "xfeat.onnx");
  EXPECT_EQ(xfeat_graph(Precision::kInt8, Device::kCpu), "xfeat_int8.onnx");
}

struct Agreement {
  int common = 0;     // points that both found, within a fifth of a pixel
  double cosine = 0;  // of their descriptors, mean
  double least_cosine = 1;
};

Agreement compare(const FeatureSet& a, const FeatureSet& b) {
  Agreement found;
  for (int i = 0; i < a.size(); ++i) {
    for (int k = 0; k < b.size(); ++k) {
      if ((a.positions[i] - b.positions[k]).norm() > 0.2f) continue;
      const double cosine = a.descriptors.row(i).dot(b.descriptors.row(k));
      ++found.common;
      found.cosine += cosine;
      found.least_cosine = std::min(found.least_cosine, cosine);
      break;
    }
  }
  found.cosine /= std::max(found.common, 1);
  return found;
}

TEST(XFeatGraph, Int8AgreesWithFloats) {
  Runtime runtime({});
  std::unique_ptr<Extractor> floats, int8;
  try {
    ExtractorOptions options;
    options.precision = Precision::kFloat;
    floats = make_extractor("xfeat-corner", runtime, options);
    options.precision = Precision::kInt8;
    int8 = make_extractor("xfeat-corner", runtime, options);
  } catch (const InputError& error) {
    GTEST_SKIP() << error.what();
  }
  auto images = testing::real_images();
  images.emplace_back("texture", testing::textured_image(320, 256));
  images.emplace_back("dark texture", 0.2 * testing::textured_image(320, 256));
  for (const auto& [name, image] : images) {
    ExtractionRequest request;
    request.budget = 800;
    const auto expected = floats->extract(image, request), actual = int8->extract(image, request);
    const auto agreement = compare(expected, actual);
    std::cout << name << ": " << agreement.common << " of " << expected.size()
              << " points in common, cosine " << agreement.cosine << " (least "
              << agreement.least_cosine << ")\n";
    EXPECT_NEAR(actual.size(), expected.size(), 0.05 * expected.size());
    EXPECT_GT(agreement.common, 0.9 * expected.size());
    EXPECT_GT(agreement.cosine, 0.997);
    EXPECT_GT(agreement.least_cosine, 0.95);
  }
}

}  // namespace
}  // namespace rover
