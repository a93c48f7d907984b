#pragma once

#include <filesystem>

#include <opencv2/core.hpp>

namespace rover {

// Writes an image (8 or 16 bit) as PNG, whole or not at all. Throws InputError, also when the
// device is full.
void write_png(const std::filesystem::path& file, const cv::Mat& image);

}  // namespace rover
