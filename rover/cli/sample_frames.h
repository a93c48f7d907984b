#pragma once

#include <filesystem>
#include <vector>

#include <opencv2/core.hpp>

#include "rover/slam/system.h"

namespace rover {

// Some keyframes of a run with their features, for its report. While the run lasts it only takes
// references to images and copies positions, of ever fewer keyframes the longer the run is.
class SampleFrames {
 public:
  // Looks at a frame that was just tracked, with its image of camera 0.
  void offer(const cv::Mat& image, const TrackingResult& result, const System& system);

  // Draws eight of them, spread over the run, into FOLDER/samples/SECONDS.jpg. Pictures of an
  // earlier run are removed. Throws InputError if they cannot be written.
  void write(const std::filesystem::path& folder) const;

 private:
  struct Sample {
    Timestamp time = 0;
    cv::Mat image;
    std::vector<Eigen::Vector2f> joined, free;  // px: with and without a landmark
  };
  std::vector<Sample> samples_;
  int keyframes_ = 0;
  int stride_ = 1;  // of the keyframes that are kept
};

}  // namespace rover
