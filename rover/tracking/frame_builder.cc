#include "rover/tracking/frame_builder.h"

#include "rover/base/error.h"

namespace rover {

void FrameBuilderOptions::check() const {
  require(features >= 50 && features <= 10000, "features is {}; use 50 to 10000", features);
  stereo.check();
}

FrameBuilder::FrameBuilder(std::shared_ptr<const Rig> rig, const FeatureFamily& family,
                           const FrameBuilderOptions& options, cv::Mat mask)
    : rig_(std::move(rig)), family_(family), options_(options), mask_(std::move(mask)) {
  options_.check();
}

Frame FrameBuilder::build(FrameId id, Timestamp time, const cv::Mat& left, const cv::Mat& right,
                          int last_matches) const {
  ExtractionRequest request;
  request.budget = options_.features;
  request.last_matches = last_matches;
  if (!mask_.empty()) request.mask = &mask_;
  Frame frame;
  frame.id = id;
  frame.time = time;
  frame.image = left;
  frame.features = std::make_shared<const FeatureSet>(family_.extractor->extract(left, request));
  const FeatureSet& features = *frame.features;
  frame.observations.resize(features.positions.size());
  for (int i = 0; i < frame.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    frame[i].pixel = features.positions[k];
    frame[i].sigma = features.sigmas[k];
  }
  if (!right.empty() && rig_->size() > 1) {
    frame.stereo =
        std::make_shared<const std::vector<StereoObservation>>(match_right(frame, right));
  }
  return frame;
}

std::vector<StereoObservation> FrameBuilder::match_right(const Frame& frame,
                                                         const cv::Mat& right) const {
  ExtractionRequest request;
  request.budget = options_.features;
  request.threshold = frame.features->threshold;
  const FeatureSet right_features = family_.extractor->extract(right, request);
  std::vector<StereoObservation> result(frame.observations.size());
  for (const StereoMatch& match :
       match_stereo(*frame.features, frame.image, right_features, right, *rig_, options_.stereo)) {
    StereoObservation& observation = result[static_cast<std::size_t>(match.left)];
    observation.pixel = match.position;
    observation.sigma = match.sigma;
    observation.point = match.point.cast<float>();
    observation.depth = static_cast<float>(match.point.norm());
    observation.depth_sigma = match.depth_sigma;
  }
  return result;
}

}  // namespace rover
