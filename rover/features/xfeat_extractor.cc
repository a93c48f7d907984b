#include "rover/features/xfeat_extractor.h"

#include <algorithm>

#include "rover/features/heatmap.h"
#include "rover/features/network_extractor.h"

namespace rover {
namespace {

constexpr float kSigma = 0.42f;  // px, measured: docs/features.md

// Bilinear between the centres (8 i + 3.5) of the cells, clamped to the outermost ones.
float sample_coarse(const float* map, int width, int height, int x, int y) {
  const auto at = [](int pixel, int count) {
    return std::clamp((static_cast<float>(pixel) - 3.5f) / 8, 0.0f, static_cast<float>(count - 1));
  };
  const float u = at(x, width), v = at(y, height);
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const int right = std::min(i + 1, width - 1), below = std::min(j + 1, height - 1);
  const float s = u - static_cast<float>(i), t = v - static_cast<float>(j);
  return (1 - t) * ((1 - s) * map[j * width + i] + s * map[j * width + right]) +
         t * ((1 - s) * map[below * width + i] + s * map[below * width + right]);
}

class XFeatExtractor final : public NetworkExtractor {
 public:
  XFeatExtractor(Runtime& runtime, const DetectionOptions& options)
      : NetworkExtractor(runtime, "xfeat_keypoints.onnx", options),
        descriptors_(output("descriptors")),
        reliability_(output("reliability")),
        logits_(output("keypoint_logits")) {}

  int descriptor_size() const override { return 64; }

 private:
  ScoreMap scores(const cv::Mat& image, const Outputs& outputs,
                  std::vector<float>& memory) const override {
    return softmax_heatmap(outputs[logits_], image.size(), loops(), pool(), memory);
  }

  float score(const Outputs& outputs, const Candidate& candidate) const override {
    const auto& map = outputs[reliability_];
    return candidate.score * sample_coarse(map.values.data(), static_cast<int>(map.shape[3]),
                                           static_cast<int>(map.shape[2]), candidate.x,
                                           candidate.y);
  }

  Located locate(const ScoreMap& scores, const Candidate& candidate) const override {
    return {refine_parabola(scores, candidate), kSigma};
  }

  Descriptors describe(const Outputs& outputs, const FeatureSet& features,
                       Workspace& workspace) const override {
    return sample_map(outputs[descriptors_], features, workspace.cells);
  }

  std::size_t descriptors_, reliability_, logits_;
};

}  // namespace

DetectionOptions xfeat_options() {
  DetectionOptions options;
  options.maxima = {.radius = 2, .border = 4, .floor = 0.05f};
  return options;
}

std::unique_ptr<Extractor> make_xfeat_extractor(Runtime& runtime, const DetectionOptions& options) {
  return std::make_unique<XFeatExtractor>(runtime, options);
}

}  // namespace rover
