// Whatever bytes a dataset holds: an error, or a counted omission; never a crash.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/base/random.h"
#include "rover/datasets/dataset.h"
#include "rover/datasets/test_folder.h"
#include "rover/datasets/test_sequences.h"

namespace rover {
namespace {

using ::testing::SizeIs;

// Replaced, removed or repeated bytes.
std::string damage(std::string text, Random& random) {
  const int changes = 1 + random.index(4);
  for (int i = 0; i < changes && !text.empty(); ++i) {
    const auto at = static_cast<std::size_t>(random.index(static_cast<int>(text.size())));
    const auto length = static_cast<std::size_t>(random.index(8));
    switch (random.index(4)) {
      case 0:
        text[at] = static_cast<char>(random.index(256));
        break;
      case 1:
        text.erase(at, length);
        break;
      case 2:
        text.insert(at, text.substr(at, length));
        break;
      default:
        text.resize(at);
    }
  }
  return text;
}

std::vector<SensorFrame> read_frames(const DatasetOptions& options) {
  const auto dataset = open_dataset(options);
  std::vector<SensorFrame> frames;
  while (auto frame = dataset->next()) frames.push_back(*frame);
  return frames;
}

TEST(RandomDamage, IsAnErrorOrLeftOut) {
  const TestFolder folder;
  write_euroc(folder);
  DatasetOptions options;
  options.path = folder.path();
  options.stereo = options.inertial = true;
  options.read_ahead = 0;
  const std::vector<std::string> files = {"mav0/cam0/data.csv",
                                          "mav0/cam1/data.csv",
                                          "mav0/imu0/data.csv",
                                          "mav0/cam0/sensor.yaml",
                                          "mav0/imu0/sensor.yaml",
                                          fmt::format("mav0/cam0/data/{}.png", euroc_time(0)),
                                          "mav0/state_groundtruth_estimate0/data.csv"};
  Random random(3);
  int opened = 0, refused = 0;
  for (int round = 0; round < 300; ++round) {
    const auto& file = files[static_cast<std::size_t>(round) % files.size()];
    const std::string whole = folder.read(file);
    folder.write(file, damage(whole, random));
    try {
      opened += read_frames(options).size() <= 5;
    } catch (const InputError&) {
      ++refused;
    }
    folder.write(file, whole);
  }
  EXPECT_EQ(opened + refused, 300);
  EXPECT_GT(opened, 50);
  EXPECT_GT(refused, 10);
}

TEST(RandomDamage, OfOneImageLeavesTheOthers) {
  const TestFolder folder;
  const TestFolder pictures;
  pictures.write_image("a.jpg", 64, 48);
  const std::string whole = pictures.read("a.jpg");
  folder.write("camera.yaml", camera_yaml(64, 48));
  Random random(4);
  folder.write("images/1000.jpg", whole);
  for (int i = 0; i < 200; ++i) {
    folder.write(fmt::format("images/{}.jpg", i), damage(whole, random));
  }
  DatasetOptions options;
  options.path = folder / "images";
  options.calibration = folder / "camera.yaml";
  const auto all = read_frames(options);
  ASSERT_THAT(all, SizeIs(201));
  for (const SensorFrame& frame : all) EXPECT_NE(frame.usable(), !frame.problems[0].empty());
  EXPECT_TRUE(all.back().usable());
}

}  // namespace
}  // namespace rover
