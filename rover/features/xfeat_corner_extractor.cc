#include "rover/features/xfeat_corner_extractor.h"

#include <algorithm>
#include <cmath>

#include "rover/features/network_extractor.h"

namespace rover {
namespace {

// Standard deviation of a corner's position, px per axis: what is left of the best, what noise does
// at low contrast, and what a flat peak leaves open in its flattest direction. Coefficients are
// fitted to residuals under known homographies (docs/features.md, uncertainty).
float position_sigma(const ScoreMap& scores, const Candidate& candidate) {
  constexpr float kBest = 0.11f, kContrast = 0.16f, kFlatness = 0.042f, kWorst = 1;
  const float* at = scores.at(candidate.x, candidate.y);
  const int row = scores.stride;
  const float xx = at[-1] - 2 * at[0] + at[1], yy = at[-row] - 2 * at[0] + at[row];
  const float xy = (at[-row - 1] + at[row + 1] - at[1 - row] - at[row - 1]) / 4;
  const float curvature = -0.5f * (xx + yy) - std::hypot(0.5f * (xx - yy), xy);
  const float variance = kBest * kBest + kContrast * kContrast / candidate.score +
                         kFlatness * kFlatness * candidate.score / std::max(curvature, 1e-6f);
  return std::min(std::sqrt(variance), kWorst);
}

class XFeatCornerExtractor final : public NetworkExtractor {
 public:
  XFeatCornerExtractor(Runtime& runtime, const std::string& graph, const DetectionOptions& options)
      : NetworkExtractor(runtime, graph, options),
        descriptors_(output("descriptors")),
        reliability_(output("reliability")) {}

  int descriptor_size() const override { return 64; }

 private:
  ScoreMap scores(const cv::Mat& image, const Outputs& outputs,
                  std::vector<float>& memory) const override {
    memory.resize(image.total());
    const kernels::ImageView view{image.data, static_cast<std::ptrdiff_t>(image.step), image.cols,
                                  image.rows};
    const auto& map = outputs[reliability_];
    const kernels::CoarseMap weight{map.values.data(), static_cast<int>(map.shape[3]),
                                    static_cast<int>(map.shape[2])};
    const auto respond = [&](std::size_t begin, std::size_t end) {
      std::vector<float> scratch(
          static_cast<std::size_t>(kernels::corner_scratch_size(image.cols)));
      loops().corner_response(view, weight, static_cast<int>(begin), static_cast<int>(end),
                              memory.data(), scratch.data());
    };
    pool().parallel_for(static_cast<std::size_t>(image.rows), respond);
    return {memory.data(), image.cols, image.cols, image.rows};
  }

  Located locate(const ScoreMap& scores, const Candidate& candidate) const override {
    return {refine_quadratic(scores, candidate), position_sigma(scores, candidate)};
  }

  Descriptors describe(const Outputs& outputs, const FeatureSet& features,
                       Workspace& workspace) const override {
    return sample_map(outputs[descriptors_], features, workspace.cells);
  }

  std::size_t descriptors_, reliability_;
};

}  // namespace

DetectionOptions xfeat_corner_options() {
  DetectionOptions options;
  options.maxima = {.radius = 4, .border = 6, .floor = 0.1f};
  return options;
}

std::unique_ptr<Extractor> make_xfeat_corner_extractor(Runtime& runtime,
                                                       const DetectionOptions& options,
                                                       Precision precision) {
  return std::make_unique<XFeatCornerExtractor>(
      runtime, xfeat_graph(precision, runtime.options().device), options);
}

}  // namespace rover
