#pragma once

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "rover/datasets/dataset.h"

namespace rover {

// The images of one frame that were kept to be looked at.
struct SampledFrame {
  Timestamp time = 0;
  std::vector<cv::Mat> images;  // one per camera; empty where there is none
};

// What one pass over a dataset has seen.
struct DatasetSurvey {
  Rig rig;
  std::optional<ImuCalibration> imu_calibration;
  std::vector<Timestamp> times;             // of all frames
  std::vector<int> missing;                 // per camera: frames without a usable image
  std::vector<std::string> image_problems;  // why, where the dataset said so
  std::vector<ImuSample> imu;
  std::vector<SampledFrame> samples;  // spread over the whole
  Trajectory ground_truth;            // of the body
  std::vector<std::string> notes;     // of the reader

  bool stereo() const { return rig.size() > 1; }
};

// Reads all frames; keeps the images of up to `samples` (at least 1) of them. Throws InputError if
// there is no frame at all.
DatasetSurvey survey_dataset(Dataset& dataset, int samples);

}  // namespace rover
