// What networks' authors get, or the Python reference implementation, against ours.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "rover/base/error.h"
#include "rover/features/aliked_describer.h"
#include "rover/features/extractor_factory.h"
#include "rover/features/test_images.h"

namespace rover {
namespace {

// The original PyTorch XFeat on the same picture (whose descriptors are sampled bicubically).
TEST(XFeat, GivesTheKeypointsOfTheOriginal) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(ROVER_SOURCE_DIR) / "../shared/models/reference";
  if (!fs::is_directory(folder)) GTEST_SKIP() << "../shared/models is absent";
  Runtime runtime({});
  ExtractorOptions options;
  options.adaptive_threshold = false;
  options.spread = 0.0f;
  std::unique_ptr<Extractor> extractor;
  try {
    extractor = make_extractor("xfeat", runtime, options);
  } catch (const InputError& error) {
    GTEST_SKIP() << error.what();
  }
  const auto read = [&](const char* name, std::size_t columns) {
    std::ifstream file(folder / name, std::ios::binary);
    file.seekg(128);  // header of the .npy format, version 1
    std::vector<float> values(4096 * columns);
    file.read(reinterpret_cast<char*>(values.data()),
              static_cast<std::streamsize>(values.size() * sizeof(float)));
    return values;
  };
  const auto keypoints = read("n4m_xfeat_keypoints.npy", 3);
  const auto descriptors = read("n4m_xfeat_descriptors.npy", 64);
  // XFeat averages the channels; OpenCV's own gray weighs them otherwise.
  const cv::Mat colour = cv::imread((folder / "n4m_test_image.png").string());
  cv::Mat image;
  cv::transform(colour, image, cv::Matx13f(1.0f / 3, 1.0f / 3, 1.0f / 3));
  ExtractionRequest request;
  request.budget = 500;
  const auto features = extractor->extract(image, request);
  ASSERT_EQ(features.size(), 500);
  int found = 0, alike = 0;
  for (int i = 0; i < features.size(); ++i) {
    for (int k = 0; k < 4096; ++k) {
      const Eigen::Vector2f original(keypoints[3 * k], keypoints[3 * k + 1]);
      if ((features.positions[i] - original).cwiseAbs().maxCoeff() > 0.51f) continue;
      ++found;
      const Eigen::Map<const Eigen::RowVectorXf> descriptor(descriptors.data() + 64 * k, 64);
      alike += features.descriptors.row(i).dot(descriptor) > 0.95f;
      break;
    }
  }
  EXPECT_GT(found, 450);
  EXPECT_GT(alike, 430);
}

class AlikedReferenceTest : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(, AlikedReferenceTest, ::testing::Values("aliked-t16", "aliked-n16"),
                         [](const auto& instance) { return instance.param.substr(7); });

TEST_P(AlikedReferenceTest, GivesItsDescriptors) {
  Runtime runtime({});
  const std::string name = GetParam();
  std::unique_ptr<AlikedDescriber> describer;
  try {
    describer = std::make_unique<AlikedDescriber>(name, runtime);
  } catch (const InputError& error) {
    GTEST_SKIP() << error.what();
  }
  auto image = testing::reference("image");
  for (float& gray : image) gray /= 255;
  const TensorView input{image, {1, 1, 96, 128}};
  const auto outputs = runtime.load(name + ".onnx")->run({&input, 1});
  const AlikedLevels levels({&outputs[1], &outputs[2], &outputs[3], &outputs[4]}, {128, 96},
                            {128, 96}, {0, 0}, kernels::best_kernels());
  const int size = describer->descriptor_size();

  const auto pixels = testing::reference(name + ".pixels");
  const auto joint = testing::reference(name + ".joint");
  std::vector<float> vector(static_cast<std::size_t>(size));
  for (std::size_t i = 0; i < pixels.size() / 2; ++i) {
    levels.at_pixel(static_cast<int>(pixels[2 * i]), static_cast<int>(pixels[2 * i + 1]),
                    vector.data());
    for (int c = 0; c < size; ++c) ASSERT_NEAR(vector[c], joint[i * size + c], 2e-3);
  }

  const auto keypoints = testing::reference(name + ".keypoints");
  const auto expected = testing::reference(name + ".descriptors");
  std::vector<Eigen::Vector2f> positions;
  for (std::size_t i = 0; i < keypoints.size(); i += 2) {
    positions.emplace_back(keypoints[i], keypoints[i + 1]);
  }
  std::vector<float> memory;
  const auto descriptors = describer->describe(levels, positions, *runtime.thread_pool(), memory);
  for (int i = 0; i < descriptors.rows(); ++i) {
    const Eigen::Map<const Eigen::RowVectorXf> row(expected.data() + i * size, size);
    EXPECT_GT(descriptors.row(i).dot(row), 0.999f) << positions[i].transpose();
  }
}

}  // namespace
}  // namespace rover
