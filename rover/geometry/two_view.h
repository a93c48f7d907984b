#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "rover/geometry/essential.h"

namespace rover {

struct TwoViewOptions {
  RansacOptions ransac = {};
  double sigma_px = 1.0;        // deviation of a keypoint on each image axis
  double focal_length = 450.0;  // px: turns pixels into angles at the image centre
  int min_points = 50;          // triangulated points that a result must have
  // Degrees. The median angle under which inliers see the baseline: below it, the pose is noise.
  double min_median_parallax = 1.0;
  // Degrees. Points below it are not triangulated, nor counted for choosing among poses.
  double min_point_parallax = 0.5;
  // The second-best pose of the decomposition must have at most this share of the best one's
  // points.
  double max_second_share = 0.7;

  double sigma() const { return sigma_px / focal_length; }  // rad
  // Throws InputError for values that make no sense.
  void check() const;
};

enum class TwoViewModel { kEssential, kHomography };

enum class TwoViewFailure {
  kTooFewPairs,   // fewer pairs than min_points
  kNoModel,       // no model has min_points inliers: wrong matches
  kLowParallax,   // the camera has hardly moved, or only turned: wait for a wider baseline
  kTooFewPoints,  // too few inliers lie in front of both cameras
  kAmbiguous,     // two poses explain the pairs about as well (a plane seen from ahead)
};

std::string_view describe(TwoViewFailure failure);

struct TwoViewResult {
  SE3 second_from_first;     // translation of length 1
  std::vector<int> inliers;  // ascending indices of pairs that fit the pose
  // For each pair its point in the first camera's frame, in units of the baseline; nothing for
  // outliers and for inliers with too little parallax.
  std::vector<std::optional<Eigen::Vector3d>> points;
  int point_count = 0;
  double median_parallax = 0;  // degrees, over the inliers
  TwoViewModel model = TwoViewModel::kEssential;
};

struct TwoViewEstimate {
  std::optional<TwoViewResult> result;
  std::optional<TwoViewFailure> failure;  // set if there is no result
};

// The relative pose of two views of one rigid scene by any camera model, without scale. Estimates
// an essential matrix and a homography by RANSAC and takes the one that describes the pairs more
// briefly (GRIC: Torr, "An assessment of information criteria for motion model selection", 1997),
// since a plane leaves the essential matrix ambiguous and depth does not fit a homography. Among
// the poses of its decomposition it takes the one with most points in front of both cameras, which
// must be clearly more than the second's. Reproducible by options.ransac.seed.
TwoViewEstimate estimate_two_view(std::span<const BearingPair> pairs,
                                  const TwoViewOptions& options = {});

}  // namespace rover
