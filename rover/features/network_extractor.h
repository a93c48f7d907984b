#pragma once

#include <memory>
#include <string>
#include <vector>

#include "rover/features/descriptor_map.h"
#include "rover/features/detection.h"
#include "rover/features/extractor.h"
#include "rover/features/image_input.h"
#include "rover/networks/runtime.h"

namespace rover {

// An extractor around one network. What differs is how a map of scores is made from its outputs,
// how a maximum is judged and refined, and how descriptors are sampled.
class NetworkExtractor : public Extractor {
 public:
  FeatureSet extract(const cv::Mat& image, const ExtractionRequest& request) const final;

 protected:
  // Memory that one extraction needs, kept for the next.
  struct Workspace {
    std::vector<float> input, scores, row_maxima, cells;
  };

  NetworkExtractor(Runtime& runtime, const std::string& file, const DetectionOptions& options);

  using Outputs = std::vector<Network::Output>;
  // Index of a named output. Throws InputError if the graph has none of that name.
  std::size_t output(const std::string& name) const;

  // Where the image's first pixel lies in the padded image.
  virtual cv::Point origin(cv::Size) const { return {0, 0}; }
  virtual ScoreMap scores(const cv::Mat& image, const Outputs& outputs,
                          std::vector<float>& memory) const = 0;
  // By which a maximum of the map is judged; the map's value unless a network says more.
  virtual float score(const Outputs&, const Candidate& candidate) const { return candidate.score; }
  virtual Located locate(const ScoreMap& scores, const Candidate& candidate) const = 0;
  virtual Descriptors describe(const Outputs& outputs, const FeatureSet& features,
                               Workspace& workspace) const = 0;

  // For describe(): from a raw map [1, channels, H/8, W/8].
  Descriptors sample_map(const Network::Output& map, const FeatureSet& features,
                         std::vector<float>& memory) const;

  ThreadPool& pool() const { return *pool_; }
  const kernels::Kernels& loops() const { return options_.loops(); }

 private:
  DetectionOptions options_;
  std::string file_;
  std::shared_ptr<const Network> network_;
  std::shared_ptr<ThreadPool> pool_;
  mutable WorkspacePool<Workspace> workspaces_;
};

}  // namespace rover
