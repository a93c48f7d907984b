#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace rover {

// One descriptor per row, unit norm, so that a dot product is the cosine similarity.
using Descriptors = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// What an extractor found in one image; immutable once made. All arrays have one entry (or row) per
// feature. Features are ordered by descending score.
struct FeatureSet {
  cv::Size image_size;                     // px, of the raw image
  std::vector<Eigen::Vector2f> positions;  // px in the raw image, pixel centres at integers
  std::vector<float> scores;               // larger is better; comparable within one family only
  std::vector<float> sigmas;               // px, standard deviation of a position per axis
  Descriptors descriptors;                 // unit rows. Binary descriptors: +-1/sqrt(bits)
  float threshold = 0;                     // of the score, that the adaptive rule chose
  int candidates = 0;                      // maxima found before the threshold was applied

  int size() const { return static_cast<int>(positions.size()); }
  bool empty() const { return positions.empty(); }
};

}  // namespace rover
