#include "rover/features/network_extractor.h"

#include <algorithm>

#include "rover/base/error.h"

namespace rover {

NetworkExtractor::NetworkExtractor(Runtime& runtime, const std::string& file,
                                   const DetectionOptions& options)
    : options_(options), file_(file), network_(runtime.load(file)), pool_(runtime.thread_pool()) {
  options.check();
}

FeatureSet NetworkExtractor::extract(const cv::Mat& image, const ExtractionRequest& request) const {
  check_request(image, request);
  const auto workspace = workspaces_.borrow();
  const auto input =
      network_input(image, 1.0f / 255, origin(image.size()), loops(), *pool_, workspace->input);
  const Outputs outputs = network_->run({&input, 1});
  const ScoreMap map = scores(image, outputs, workspace->scores);
  const Judgement judgement{[&](const Candidate& c) { return score(outputs, c); },
                            [&](const Candidate& c) { return locate(map, c); }};
  FeatureSet features = detect(map, options_, request, judgement, *pool_, workspace->row_maxima);
  features.descriptors = describe(outputs, features, *workspace);
  return features;
}

std::size_t NetworkExtractor::output(const std::string& name) const {
  const auto& names = network_->output_names();
  const auto found = std::find(names.begin(), names.end(), name);
  require(found != names.end(), "the model {} has no output {}: run `make build` to write it again",
          file_, name);
  return static_cast<std::size_t>(found - names.begin());
}

Descriptors NetworkExtractor::sample_map(const Network::Output& map, const FeatureSet& features,
                                         std::vector<float>& memory) const {
  return DescriptorMap(map.values.data(), static_cast<int>(map.shape[1]),
                       static_cast<int>(map.shape[3]), static_cast<int>(map.shape[2]), loops(),
                       *pool_, memory)
      .sample(features.positions, *pool_);
}

}  // namespace rover
