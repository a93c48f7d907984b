#include "rover/features/xfeat_extractor.h"

#include "rover/features/heatmap.h"
#include "rover/features/network_extractor.h"

namespace rover {
namespace {

constexpr float kSigma = 0.5f;  // px, measured: docs/features.md

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
    const auto heat = softmax_heatmap(outputs[logits_], image.size(), loops(), pool(), memory);
    const auto& map = outputs[reliability_];
    const kernels::CoarseMap weight{map.values.data(), static_cast<int>(map.shape[3]),
                                    static_cast<int>(map.shape[2])};
    pool().parallel_for(
        static_cast<std::size_t>(heat.height), [&](std::size_t begin, std::size_t end) {
          std::vector<float> scratch(
              static_cast<std::size_t>(kernels::corner_scratch_size(heat.stride)));
          loops().multiply_rows(weight, static_cast<int>(begin), static_cast<int>(end), heat.stride,
                                memory.data(), scratch.data());
        });
    return heat;
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
