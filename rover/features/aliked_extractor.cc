#include "rover/features/aliked_extractor.h"

#include <cmath>

#include "rover/base/error.h"
#include "rover/features/aliked_describer.h"
#include "rover/features/network_extractor.h"

namespace rover {
namespace {

constexpr float kTemperature = 0.1f;
constexpr float kSigma = 0.16f;  // px, measured: docs/features.md

// Expected offset under softmax(score / temperature) over 5x5 (Zhao et al., ALIKE, 2022, eq. 4).
Eigen::Vector2f refine_soft_argmax(const ScoreMap& map, const Candidate& candidate) {
  float sum = 0;
  Eigen::Vector2f offset(0, 0);
  for (int j = -2; j <= 2; ++j) {
    for (int i = -2; i <= 2; ++i) {
      const float score = *map.at(candidate.x + i, candidate.y + j);
      const float weight = std::exp((score - candidate.score) / kTemperature);
      sum += weight;
      offset += weight * Eigen::Vector2f(static_cast<float>(i), static_cast<float>(j));
    }
  }
  return Eigen::Vector2f(static_cast<float>(candidate.x), static_cast<float>(candidate.y)) +
         offset / sum;
}

class AlikedExtractor final : public NetworkExtractor {
 public:
  AlikedExtractor(const std::string& name, Runtime& runtime, const DetectionOptions& options)
      : NetworkExtractor(runtime, name + ".onnx", options),
        describer_(name, runtime),
        scores_(output("scores")),
        levels_{output("level1"), output("level2"), output("level3"), output("level4")} {}

  int descriptor_size() const override { return describer_.descriptor_size(); }

 private:
  cv::Point origin(cv::Size size) const override {
    const cv::Size missing = padded_size(size) - size;
    return {missing.width / 2, missing.height / 2};
  }

  ScoreMap scores(const cv::Mat& image, const Outputs& outputs,
                  std::vector<float>&) const override {
    const cv::Point first = origin(image.size());
    const int stride = padded_size(image.size()).width;
    return {
        outputs[scores_].values.data() + static_cast<std::ptrdiff_t>(first.y) * stride + first.x,
        stride, image.cols, image.rows};
  }

  Located locate(const ScoreMap& scores, const Candidate& candidate) const override {
    return {refine_soft_argmax(scores, candidate), kSigma};
  }

  Descriptors describe(const Outputs& outputs, const FeatureSet& features,
                       Workspace& workspace) const override {
    const AlikedLevels levels(
        {&outputs[levels_[0]], &outputs[levels_[1]], &outputs[levels_[2]], &outputs[levels_[3]]},
        padded_size(features.image_size), features.image_size, origin(features.image_size),
        loops());
    return describer_.describe(levels, features.positions, pool(), workspace.cells);
  }

  AlikedDescriber describer_;
  std::size_t scores_;
  std::array<std::size_t, 4> levels_;
};

}  // namespace

DetectionOptions aliked_options() {
  DetectionOptions options;
  options.maxima = {.radius = 2, .border = 4, .floor = 0.05f};
  return options;
}

std::unique_ptr<Extractor> make_aliked_extractor(const std::string& name, Runtime& runtime,
                                                 const DetectionOptions& options) {
  require(name == "aliked-t16" || name == "aliked-n16", "there is no {}", name);
  return std::make_unique<AlikedExtractor>(name, runtime, options);
}

}  // namespace rover
