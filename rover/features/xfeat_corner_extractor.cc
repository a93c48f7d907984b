#include "rover/features/xfeat_corner_extractor.h"

#include "rover/features/network_extractor.h"

namespace rover {
namespace {

class XFeatCornerExtractor final : public NetworkExtractor {
 public:
  XFeatCornerExtractor(Runtime& runtime, const DetectionOptions& options)
      : NetworkExtractor(runtime, "xfeat.onnx", options),
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
    return {refine_quadratic(scores, candidate), 0.3f};
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
                                                       const DetectionOptions& options) {
  return std::make_unique<XFeatCornerExtractor>(runtime, options);
}

}  // namespace rover
