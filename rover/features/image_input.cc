#include "rover/features/image_input.h"

#include <algorithm>

#include "rover/base/error.h"

namespace rover {

void check_request(const cv::Mat& image, const ExtractionRequest& request) {
  require(image.type() == CV_8UC1, "features: the image must be 8 bit with one channel, not {}",
          cv::typeToString(image.type()));
  require(image.cols >= 32 && image.rows >= 32,
          "features: the image must be at least 32x32 pixels, not {}x{}", image.cols, image.rows);
  require(request.budget >= 1, "features: the budget must be positive, not {}", request.budget);
  if (const cv::Mat* mask = request.mask) {
    require(mask->type() == CV_8UC1 && mask->size() == image.size(),
            "features: the mask must be 8 bit with one channel and {}x{} like the image, not {} "
            "{}x{}",
            image.cols, image.rows, cv::typeToString(mask->type()), mask->cols, mask->rows);
  }
}

cv::Size padded_size(cv::Size size) {
  const auto up = [](int n) { return (n + kNetworkStride - 1) / kNetworkStride * kNetworkStride; };
  return {up(size.width), up(size.height)};
}

TensorView network_input(const cv::Mat& image, float scale, cv::Point origin,
                         const kernels::Kernels& kernels, ThreadPool& pool,
                         std::vector<float>& memory) {
  const cv::Size size = padded_size(image.size());
  memory.resize(static_cast<std::size_t>(size.area()));
  pool.parallel_for(static_cast<std::size_t>(size.height), [&](std::size_t begin, std::size_t end) {
    for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      float* row = memory.data() + static_cast<std::ptrdiff_t>(y) * size.width;
      kernels.to_float(image.ptr(std::clamp(y - origin.y, 0, image.rows - 1)), image.cols, scale,
                       row + origin.x, size.width - origin.x);
      std::fill_n(row, origin.x, row[origin.x]);
    }
  });
  return {memory, {1, 1, size.height, size.width}};
}

}  // namespace rover
