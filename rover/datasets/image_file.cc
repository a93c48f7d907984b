#include "rover/datasets/image_file.h"

#include <cstdint>
#include <fstream>
#include <string_view>
#include <system_error>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "rover/base/error.h"
#include "rover/datasets/image_bytes.h"

namespace rover {
namespace {

constexpr std::uintmax_t kMaxBytes = std::uintmax_t{1} << 29;

std::vector<std::uint8_t> read_bytes(const std::filesystem::path& file) {
  std::error_code error;
  require(std::filesystem::is_regular_file(file, error), "the file is missing");
  const auto size = std::filesystem::file_size(file, error);
  require(!error && size > 0, "the file is empty");
  require(size <= kMaxBytes, "the file is too large for an image");
  std::vector<std::uint8_t> bytes(size);
  std::ifstream stream(file, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  require(static_cast<std::uintmax_t>(stream.gcount()) == size, "the file cannot be read");
  return bytes;
}

void check_size(cv::Size size, cv::Size expected) {
  require(expected.empty() || size == expected, "{}x{} px, but the calibration is for {}x{}",
          size.width, size.height, expected.width, expected.height);
}

// Formats without a check of their own here. Others that OpenCV may know are refused.
bool is_plain_format(const std::vector<std::uint8_t>& bytes) {
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()),
                              std::min<std::size_t>(bytes.size(), 4));
  using namespace std::string_view_literals;
  for (const auto prefix : {"P5"sv, "P6"sv, "BM"sv, "II*\0"sv, "MM\0*"sv}) {
    if (head.starts_with(prefix)) return true;
  }
  return false;
}

cv::Mat decode(const std::vector<std::uint8_t>& bytes) {
  try {
    return cv::imdecode(bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    return {};
  }
}

cv::Mat load(const std::filesystem::path& file, cv::Size expected) {
  const auto bytes = read_bytes(file);
  if (const auto structure = inspect_image(bytes)) {
    require(structure->complete, "the file is cut off");
    require(!structure->size.empty(), "the file is damaged");
    check_size(structure->size, expected);
  } else {
    require(is_plain_format(bytes), "not a PNG, JPEG, PGM, BMP or TIFF file");
  }
  const cv::Mat image = decode(bytes);
  require(!image.empty() && image.type() == CV_8UC1, "the file is damaged");
  check_size(image.size(), expected);
  return image;
}

}  // namespace

LoadedImage load_gray_image(const std::filesystem::path& file, cv::Size expected) {
  try {
    return {load(file, expected), ""};
  } catch (const std::exception& error) {
    return {{}, fmt::format("{}: {}", file.string(), error.what())};
  }
}

}  // namespace rover
