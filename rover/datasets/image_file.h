#pragma once

#include <filesystem>
#include <string>

#include <opencv2/core.hpp>

namespace rover {

// An image, or why there is none: exactly one of the two is empty.
struct LoadedImage {
  cv::Mat image;        // 8 bit, one channel
  std::string problem;  // one line that names the file
};

// Reads any image file as 8-bit gray. Never throws: missing, empty, cut or damaged files, and
// images of another size than `expected` (any size if that is empty), are problems of this one
// image.
LoadedImage load_gray_image(const std::filesystem::path& file, cv::Size expected);

}  // namespace rover
