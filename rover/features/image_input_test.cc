#include "rover/features/image_input.h"

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/features/test_images.h"

namespace rover {
namespace {

TEST(CheckRequest, TakesGrayImagesOf32PixelsAndMore) {
  EXPECT_NO_THROW(check_request(cv::Mat::zeros(32, 32, CV_8UC1), {}));
  EXPECT_THROW(check_request(cv::Mat(), {}), InputError);
  EXPECT_THROW(check_request(cv::Mat::zeros(31, 640, CV_8UC1), {}), InputError);
  EXPECT_THROW(check_request(cv::Mat::zeros(480, 31, CV_8UC1), {}), InputError);
  EXPECT_THROW(check_request(cv::Mat::zeros(480, 640, CV_8UC3), {}), InputError);
  EXPECT_THROW(check_request(cv::Mat::zeros(480, 640, CV_16UC1), {}), InputError);
  EXPECT_THROW(check_request(cv::Mat::zeros(480, 640, CV_32FC1), {}), InputError);
}

TEST(CheckRequest, TakesMasksOfTheImagesSize) {
  const cv::Mat image = cv::Mat::zeros(48, 64, CV_8UC1);
  const auto check = [&](const cv::Mat& mask, int budget) {
    ExtractionRequest request;
    request.mask = &mask;
    request.budget = budget;
    check_request(image, request);
  };
  EXPECT_NO_THROW(check(image, 1));
  EXPECT_THROW(check(image, 0), InputError);
  EXPECT_THROW(check(cv::Mat::zeros(48, 63, CV_8UC1), 1), InputError);
  EXPECT_THROW(check(cv::Mat::zeros(48, 64, CV_8UC3), 1), InputError);
}

TEST(NetworkInput, RepeatsTheBorderUpToTheNextMultiple) {
  const cv::Mat image = testing::textured_image(41, 33);
  ThreadPool pool(2);
  std::vector<float> memory;
  for (const cv::Point origin : {cv::Point(0, 0), cv::Point(11, 15)}) {
    const auto input = network_input(image, 0.5f, origin, kernels::best_kernels(), pool, memory);
    EXPECT_EQ(input.shape, (std::vector<std::int64_t>{1, 1, 64, 64}));
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        const int sx = std::clamp(x - origin.x, 0, 40), sy = std::clamp(y - origin.y, 0, 32);
        ASSERT_EQ(input.values[y * 64 + x], 0.5f * image.at<std::uint8_t>(sy, sx));
      }
    }
  }
}

TEST(WorkspacePool, HandsOutEachOneOnce) {
  WorkspacePool<int> pool;
  int* first = nullptr;
  {
    const auto a = pool.borrow();
    const auto b = pool.borrow();
    EXPECT_NE(&*a, &*b);
    first = &*a;
  }
  EXPECT_EQ(&*pool.borrow(), first);
}

}  // namespace
}  // namespace rover
