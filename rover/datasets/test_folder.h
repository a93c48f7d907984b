#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "rover/base/error.h"

namespace rover {

// A folder for one test, removed with all that it holds.
class TestFolder {
 public:
  TestFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "rover-test-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~TestFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

  void write(const std::string& name, const std::string& content) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << content;
  }
  std::string read(const std::string& name) const {
    std::ifstream stream(path_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void write_image(const std::string& name, int width, int height, int gray = 100) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    cv::Mat image(height, width, CV_8UC1, cv::Scalar(gray));
    image.at<unsigned char>(height / 2, width / 2) = 255;
    cv::imwrite((path_ / name).string(), image);
  }

 private:
  std::filesystem::path path_;
};

// The message of the InputError that a call throws; the test fails if it throws none.
template <class Call>
std::string input_error_of(const Call& call) {
  try {
    call();
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message;
  }
  ADD_FAILURE() << "no InputError was thrown";
  return "";
}

// The folder of shared sequences beside a developer's checkout; tests skip where it is absent.
inline std::filesystem::path shared_folder() {
  return std::filesystem::path(ROVER_SOURCE_DIR) / ".." / "shared";
}

}  // namespace rover
