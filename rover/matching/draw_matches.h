#pragma once

#include <span>

#include <opencv2/core.hpp>

#include "rover/features/feature_set.h"
#include "rover/matching/matcher.h"

namespace rover {

// Two gray (8 bit) images side by side, in colour: features as small circles, gray where they have
// no match; matches as lines from red (score 0) over yellow to green (score 1).
cv::Mat draw_matches(const cv::Mat& image_a, const FeatureSet& a, const cv::Mat& image_b,
                     const FeatureSet& b, std::span<const Match> matches);

}  // namespace rover
