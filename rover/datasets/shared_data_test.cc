// The real sequences beside a developer's checkout (see their README).
#include <gtest/gtest.h>

#include "rover/datasets/dataset.h"
#include "rover/datasets/test_folder.h"

namespace rover {
namespace {

struct Expected {
  const char* folder;
  bool stereo;
  bool inertial;
  std::size_t frames;
  std::size_t poses;
};

class SharedData : public ::testing::TestWithParam<Expected> {};

TEST_P(SharedData, OpensAndDelivers) {
  const Expected& expected = GetParam();
  DatasetOptions options;
  options.path = shared_folder() / "data" / expected.folder;
  if (!std::filesystem::exists(options.path)) GTEST_SKIP() << options.path << " is not here";
  options.stereo = expected.stereo;
  options.inertial = expected.inertial;
  const auto dataset = open_dataset(options);
  EXPECT_EQ(dataset->size(), expected.frames);
  EXPECT_EQ(dataset->ground_truth().size(), expected.poses);
  EXPECT_TRUE(dataset->notes().empty()) << dataset->notes().front();
  std::size_t usable = 0, samples = 0;
  while (const auto frame = dataset->next()) {
    usable += frame->usable() && !frame->images.back().empty();
    samples += frame->imu.size();
  }
  EXPECT_EQ(usable, expected.frames);
  EXPECT_EQ(samples > expected.frames, expected.inertial);
}

INSTANTIATE_TEST_SUITE_P(
    Sequences, SharedData,
    ::testing::Values(Expected{"tum_rgbd/freiburg1_xyz", false, false, 798, 3000},
                      Expected{"kitti/00_first201", true, false, 201, 201},
                      Expected{"euroc/V1_01_clip", false, true, 90, 2895},
                      Expected{"euroc/V1_01_sparse_stereo", true, true, 100, 2895}));

}  // namespace
}  // namespace rover
