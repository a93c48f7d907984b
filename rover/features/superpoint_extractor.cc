#include "rover/features/superpoint_extractor.h"

#include "rover/features/heatmap.h"
#include "rover/features/network_extractor.h"

namespace rover {
namespace {

constexpr float kSigma = 0.25f;  // px, measured: docs/features.md

class SuperPointExtractor final : public NetworkExtractor {
 public:
  SuperPointExtractor(Runtime& runtime, const DetectionOptions& options)
      : NetworkExtractor(runtime, "superpoint.onnx", options),
        logits_(output("semi")),
        descriptors_(output("desc")) {}

  int descriptor_size() const override { return 256; }

 private:
  ScoreMap scores(const cv::Mat& image, const Outputs& outputs,
                  std::vector<float>& memory) const override {
    return softmax_heatmap(outputs[logits_], image.size(), loops(), pool(), memory);
  }

  Located locate(const ScoreMap& scores, const Candidate& candidate) const override {
    return {refine_centroid(scores, candidate, 2), kSigma};
  }

  Descriptors describe(const Outputs& outputs, const FeatureSet& features,
                       Workspace& workspace) const override {
    return sample_map(outputs[descriptors_], features, workspace.cells);
  }

  std::size_t logits_, descriptors_;
};

}  // namespace

DetectionOptions superpoint_options() {
  DetectionOptions options;
  options.maxima = {.radius = 4, .border = 4, .floor = 0.005f};
  return options;
}

std::unique_ptr<Extractor> make_superpoint_extractor(Runtime& runtime,
                                                     const DetectionOptions& options) {
  return std::make_unique<SuperPointExtractor>(runtime, options);
}

}  // namespace rover
