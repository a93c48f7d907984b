#include "rover/simulation/sequence_image.h"

#include <string_view>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "rover/datasets/atomic_file.h"

namespace rover {

void write_png(const std::filesystem::path& file, const cv::Mat& image) {
  constexpr int kFast = 1;
  std::vector<unsigned char> bytes;
  cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, kFast});
  write_file_atomically(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace rover
