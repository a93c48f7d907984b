#pragma once

#include <filesystem>
#include <vector>

#include <opencv2/core.hpp>

namespace rover {

// All images of a folder in the order of their names, gray, shrunk to at most 2048 px along the
// longer side. Throws InputError if there is none that can be read.
std::vector<cv::Mat> read_photographs(const std::filesystem::path& folder);

}  // namespace rover
