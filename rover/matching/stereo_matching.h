#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "rover/camera/camera.h"
#include "rover/features/feature_set.h"

namespace rover {

// A left feature seen in the right image too.
struct StereoMatch {
  int left = -1;
  int right = -1;            // the right feature
  Eigen::Vector2f position;  // px in the raw right image, refined
  float sigma = 1;           // px, of that position; at least 1 where refinement failed
  Eigen::Vector3d point;     // triangulated, m, frame of the left camera
  float depth_sigma = 0;     // m, standard deviation of the point's distance
};

struct StereoMatchingOptions {
  float min_similarity = 0.7f;  // cosine of the two descriptors
  float epipolar_gate = 2.0f;   // px from the epipolar line, for features at sigma 1 px
  float min_depth = 0.2f;       // m
  float max_depth = 1000.0f;    // m
  bool refine = true;           // photometric refinement of the right position
  // px: what cannot be refined is kept up to this sigma of both features together. Above, it is
  // noise or texture rather than a corner, and nothing confirms that it is the same one.
  float max_unaligned_sigma = 0.4f;

  void check() const;
};

// Matches the features of two cameras of a rig along their epipolar lines (no rectification: works
// for any models and poses), keeps mutual best ones, refines the right position photometrically
// against the left image and triangulates. Matches that fail the reprojection or depth check are
// dropped. Ordered by left feature.
std::vector<StereoMatch> match_stereo(const FeatureSet& left, const cv::Mat& left_image,
                                      const FeatureSet& right, const cv::Mat& right_image,
                                      const Rig& rig, const StereoMatchingOptions& options);

}  // namespace rover
