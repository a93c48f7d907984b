#include "rover/features/heatmap.h"

namespace rover {

ScoreMap softmax_heatmap(const Network::Output& logits, cv::Size size,
                         const kernels::Kernels& kernels, ThreadPool& pool,
                         std::vector<float>& memory) {
  const int height = static_cast<int>(logits.shape[2]), width = static_cast<int>(logits.shape[3]);
  memory.resize(static_cast<std::size_t>(64) * width * height);
  pool.parallel_for(static_cast<std::size_t>(height), [&](std::size_t begin, std::size_t end) {
    std::vector<float> scratch(static_cast<std::size_t>(66) * width);
    kernels.softmax_cells(logits.values.data(), width, height, static_cast<int>(begin),
                          static_cast<int>(end), memory.data(), scratch.data());
  });
  return {memory.data(), 8 * width, size.width, size.height};
}

Eigen::Vector2f refine_centroid(const ScoreMap& map, const Candidate& candidate, int radius) {
  float sum = 0, x = 0, y = 0;
  for (int j = -radius; j <= radius; ++j) {
    for (int i = -radius; i <= radius; ++i) {
      const float weight = *map.at(candidate.x + i, candidate.y + j);
      sum += weight;
      x += weight * static_cast<float>(i);
      y += weight * static_cast<float>(j);
    }
  }
  return {static_cast<float>(candidate.x) + x / sum, static_cast<float>(candidate.y) + y / sum};
}

}  // namespace rover
