#pragma once

#include <vector>

#include "rover/camera/camera.h"
#include "rover/diagnosis/dataset_survey.h"
#include "rover/diagnosis/finding.h"
#include "rover/matching/feature_family.h"

namespace rover {

// What can be said of one image without knowing what it shows.
struct ImageFigures {
  double brightness = 0;  // mean gray level
  double dark = 0;        // share of pixels at 5 or below
  double bright = 0;      // share of pixels at 250 or above
  double blur = 0;        // 0 sharp to 1 blurred: Crete et al., "The blur effect" (2007)
};
ImageFigures figures_of(const cv::Mat& image);  // 8 bit, one channel

// Features of each sampled image, by frame and camera; none where there is no image.
using SampledFeatures = std::vector<std::vector<FeatureSet>>;
SampledFeatures extract_samples(const std::vector<SampledFrame>& samples,
                                const FeatureFamily& family, int budget);

// Exposure, blur and features of the sampled frames, camera by camera.
void check_images(const std::vector<SampledFrame>& samples, const SampledFeatures& features,
                  Findings& findings);

// Matches features of cameras 0 and 1 without knowing the calibration, and measures how far they
// lie from the epipolar lines that it gives.
void check_stereo(const Rig& rig, const std::vector<SampledFrame>& samples,
                  const SampledFeatures& features, const FeatureFamily& family, Findings& findings);

}  // namespace rover
