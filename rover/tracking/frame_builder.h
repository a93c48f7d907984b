#pragma once

#include <memory>

#include <opencv2/core.hpp>

#include "rover/camera/camera.h"
#include "rover/map/frame.h"
#include "rover/matching/feature_family.h"
#include "rover/matching/stereo_matching.h"

namespace rover {

struct FrameBuilderOptions {
  int features = 800;  // per image of 640x480 at most; other sizes in proportion
  StereoMatchingOptions stereo;

  void check() const;
};

// Images in, frame out: step 1 of the pipeline (features), with stereo partners.
class FrameBuilder {
 public:
  // mask: 8 bit of camera 0's size or empty; no features where it is 0.
  FrameBuilder(std::shared_ptr<const Rig> rig, const FeatureFamily& family,
               const FrameBuilderOptions& options, cv::Mat mask = {});

  // right may be empty. last_matches: of the last tracked frame, for the adaptive threshold.
  Frame build(FrameId id, Timestamp time, const cv::Mat& left, const cv::Mat& right,
              int last_matches) const;

 private:
  std::vector<StereoObservation> match_right(const Frame& frame, const cv::Mat& right) const;

  std::shared_ptr<const Rig> rig_;
  FeatureFamily family_;
  FrameBuilderOptions options_;
  cv::Mat mask_;
};

}  // namespace rover
