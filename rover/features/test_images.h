#pragma once

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "rover/base/random.h"

// Images and reference values for the tests of this folder.
namespace rover::testing {

// Blocks of random gray, slightly blurred and noisy: corners everywhere.
inline cv::Mat textured_image(int width, int height, std::uint64_t seed = 1) {
  cv::Mat image(height, width, CV_8UC1);
  Random random(seed);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto block = static_cast<std::uint64_t>(y / 11 * 10007 + x / 13);
      const double gray = static_cast<double>(hash_seed(seed, block) % 200) + 28;
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(gray + random.gaussian());
    }
  }
  cv::GaussianBlur(image, image, {}, 1.0);
  return image;
}

// One frame of each recorded data set that lies beside the checkout, with the set's name.
inline std::vector<std::pair<std::string, cv::Mat>> real_images() {
  namespace fs = std::filesystem;
  const fs::path data = fs::path(ROVER_SOURCE_DIR) / "../shared/data";
  std::vector<std::pair<std::string, cv::Mat>> images;
  for (const char* folder : {"tum_rgbd/freiburg1_xyz/rgb", "kitti/00_first201/image_0",
                             "euroc/V1_01_sparse_stereo/mav0/cam0/data"}) {
    if (!fs::is_directory(data / folder)) continue;
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(data / folder)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    images.emplace_back(folder, cv::imread(files[files.size() / 3].string(), cv::IMREAD_GRAYSCALE));
  }
  return images;
}

// Values that the Python reference implementation recorded (docs/networks.md).
inline std::vector<float> reference(const std::string& name) {
  const auto folder = std::filesystem::path(ROVER_SOURCE_DIR) / "tests/data/networks";
  const auto entry = nlohmann::json::parse(std::ifstream(folder / "reference.json")).at(name);
  std::size_t count = 1;
  for (const std::size_t length : entry.at("shape")) count *= length;
  std::vector<float> values(count);
  std::ifstream file(folder / "reference.bin", std::ios::binary);
  file.seekg(static_cast<std::streamoff>(entry.at("offset").get<std::size_t>() * sizeof(float)));
  file.read(reinterpret_cast<char*>(values.data()),
            static_cast<std::streamsize>(count * sizeof(float)));
  if (!file) throw std::runtime_error("tests/data/networks/reference.bin is too short");
  return values;
}

}  // namespace rover::testing
