#include "rover/simulation/texture_photographs.h"

#include <algorithm>

#include <opencv2/imgproc.hpp>

#include "rover/base/error.h"
#include "rover/datasets/image_file.h"
#include "rover/datasets/image_names.h"

namespace rover {
namespace fs = std::filesystem;

std::vector<cv::Mat> read_photographs(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (has_image_name(entry.path())) files.push_back(entry.path());
  }
  require(!error, "--textures {}: cannot be read ({}); give a folder of photographs",
          folder.string(), error.message());
  std::sort(files.begin(), files.end());
  std::vector<cv::Mat> photographs;
  constexpr int kSmallest = 16, kLargest = 2048;
  for (const fs::path& file : files) {
    cv::Mat image = load_gray_image(file, {}).image;
    if (std::min(image.cols, image.rows) < kSmallest) continue;
    const double scale = static_cast<double>(kLargest) / std::max(image.cols, image.rows);
    if (scale < 1) cv::resize(image, image, {}, scale, scale, cv::INTER_AREA);
    photographs.push_back(image);
  }
  require(!photographs.empty(),
          "--textures {}: holds no usable image (PNG or JPEG, at least {} px wide and high)",
          folder.string(), kSmallest);
  return photographs;
}

}  // namespace rover
