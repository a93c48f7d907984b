#include "rover/features/aliked_extractor.h"

#include <algorithm>
#include <cmath>

#include "rover/base/error.h"
#include "rover/features/aliked_levels.h"
#include "rover/features/network_extractor.h"

namespace rover {
namespace {

constexpr int kPatch = 3, kPositions = 16;
constexpr float kTemperature = 0.1f;

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
        offsets_(runtime.load(name + "_offsets.onnx")),
        descriptors_(runtime.load(name + "_descriptors.onnx")),
        size_(name == "aliked-t16" ? 64 : 128),
        scores_(output("scores")),
        levels_{output("level1"), output("level2"), output("level3"), output("level4")} {}

  int descriptor_size() const override { return size_; }

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
    return {refine_soft_argmax(scores, candidate), 0.16f};
  }

  Descriptors describe(const Outputs& outputs, const FeatureSet& features,
                       Workspace& workspace) const override {
    Descriptors descriptors(features.size(), size_);
    if (features.empty()) return descriptors;
    const AlikedLevels levels(
        {&outputs[levels_[0]], &outputs[levels_[1]], &outputs[levels_[2]], &outputs[levels_[3]]},
        padded_size(features.image_size), features.image_size, origin(features.image_size),
        loops());
    const auto patches = gather_patches(levels, features, workspace.cells);
    const auto offsets = offsets_->run({&patches, 1});
    const auto samples =
        gather_samples(levels, features, offsets[0].values.data(), workspace.cells);
    const auto described = descriptors_->run({&samples, 1});
    std::copy(described[0].values.begin(), described[0].values.end(), descriptors.data());
    return descriptors;
  }

  // [N, 9, dim]: the joint vectors of 3x3 pixels around each feature.
  TensorView gather_patches(const AlikedLevels& levels, const FeatureSet& features,
                            std::vector<float>& memory) const {
    constexpr int kPixels = kPatch * kPatch;
    memory.resize(static_cast<std::size_t>(features.size()) * kPixels * size_);
    const auto corner = [](float position, int length) {
      return std::clamp(static_cast<int>(std::trunc(std::trunc(position) - 0.5f)), 0, length - 4);
    };
    pool().parallel_for(features.positions.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        const int x = corner(features.positions[n].x(), features.image_size.width);
        const int y = corner(features.positions[n].y(), features.image_size.height);
        for (int k = 0; k < kPixels; ++k) {
          levels.at_pixel(x + k % kPatch, y + k / kPatch,
                          memory.data() + (n * kPixels + k) * size_);
        }
      }
    });
    return {memory, {features.size(), kPixels, size_}};
  }

  // [N, 16, dim]: joint vectors at each feature's position plus its offsets [N, 16, 2] (px).
  TensorView gather_samples(const AlikedLevels& levels, const FeatureSet& features,
                            const float* offsets, std::vector<float>& memory) const {
    memory.resize(static_cast<std::size_t>(features.size()) * kPositions * size_);
    const auto& size = features.image_size;
    const float limit = static_cast<float>(std::max(size.width, size.height)) / 4;
    pool().parallel_for(features.positions.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin * kPositions; i < end * kPositions; ++i) {
        const auto& position = features.positions[i / kPositions];
        levels.interpolate(position.x() + std::clamp(offsets[2 * i], -limit, limit),
                           position.y() + std::clamp(offsets[2 * i + 1], -limit, limit),
                           memory.data() + i * size_);
      }
    });
    return {memory, {features.size(), kPositions, size_}};
  }

  std::shared_ptr<const Network> offsets_, descriptors_;
  int size_;
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
