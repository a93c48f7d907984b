#include "rover/features/xfeat_corner_extractor.h"

#include "rover/features/descriptor_map.h"
#include "rover/features/image_input.h"

namespace rover {
namespace {

struct Workspace {
  std::vector<float> input, response, row_maxima, cells;
};

class XFeatCornerExtractor final : public Extractor {
 public:
  XFeatCornerExtractor(Runtime& runtime, const XFeatCornerOptions& options)
      : options_(options),
        network_(runtime.load("xfeat.onnx")),
        pool_(runtime.thread_pool()),
        kernels_(options.kernels ? *options.kernels : kernels::best_kernels()) {}

  FeatureSet extract(const cv::Mat& image, const ExtractionRequest& request) const override {
    check_request(image, request);
    const auto workspace = workspaces_.borrow();
    const auto input = network_input(image, 1.0f / 255, kernels_, *pool_, workspace->input);
    const auto outputs = network_->run({&input, 1});
    const ScoreMap scores = corner_scores(image, outputs[1], workspace->response);
    auto candidates = find_local_maxima(scores, options_.maxima, request.mask, kernels_, *pool_,
                                        workspace->row_maxima);
    const auto selection = select_candidates(std::move(candidates), request, options_.selection,
                                             options_.maxima.radius);
    FeatureSet features = locate(selection, scores);
    features.image_size = image.size();
    const auto& shape = outputs[0].shape;
    const DescriptorMap map(outputs[0].values.data(), descriptor_size(), static_cast<int>(shape[3]),
                            static_cast<int>(shape[2]), kernels_, *pool_, workspace->cells);
    features.descriptors = map.sample(features.positions, *pool_);
    return features;
  }

  int descriptor_size() const override { return 64; }

 private:
  ScoreMap corner_scores(const cv::Mat& image, const Network::Output& reliability,
                         std::vector<float>& response) const {
    response.resize(image.total());
    const kernels::ImageView view{image.data, static_cast<std::ptrdiff_t>(image.step), image.cols,
                                  image.rows};
    const kernels::CoarseMap weight{reliability.values.data(),
                                    static_cast<int>(reliability.shape[3]),
                                    static_cast<int>(reliability.shape[2])};
    pool_->parallel_for(
        static_cast<std::size_t>(image.rows), [&](std::size_t begin, std::size_t end) {
          std::vector<float> scratch(
              static_cast<std::size_t>(kernels::corner_scratch_size(image.cols)));
          kernels_.corner_response(view, weight, static_cast<int>(begin), static_cast<int>(end),
                                   response.data(), scratch.data());
        });
    return {response.data(), image.cols, image.cols, image.rows};
  }

  FeatureSet locate(const Selection& selection, const ScoreMap& scores) const {
    FeatureSet features;
    features.threshold = selection.threshold;
    features.candidates = selection.candidates;
    for (const auto& candidate : selection.chosen) {
      const cv::Point2f position = refine_parabola(scores, candidate);
      features.positions.emplace_back(position.x, position.y);
      features.scores.push_back(candidate.score);
      features.sigmas.push_back(0.3f);
    }
    return features;
  }

  XFeatCornerOptions options_;
  std::shared_ptr<const Network> network_;
  std::shared_ptr<ThreadPool> pool_;
  const kernels::Kernels& kernels_;
  mutable WorkspacePool<Workspace> workspaces_;
};

}  // namespace

void XFeatCornerOptions::check() const {
  maxima.check();
  selection.check();
}

std::unique_ptr<Extractor> make_xfeat_corner_extractor(Runtime& runtime,
                                                       const XFeatCornerOptions& options) {
  options.check();
  return std::make_unique<XFeatCornerExtractor>(runtime, options);
}

}  // namespace rover
