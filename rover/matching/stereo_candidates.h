#pragma once

#include <span>
#include <vector>

#include "rover/camera/camera.h"
#include "rover/features/feature_set.h"
#include "rover/matching/epipolar.h"
#include "rover/matching/stereo_matching.h"

namespace rover {

// The rays of a stereo pair's features, in the right camera's frame, ordered by the epipolar plane
// they lie in. A plane through the baseline has one number: its angle about it. Corresponding rays
// share it whatever the camera models, so candidates are neighbours in a ring of buckets.
class StereoCandidates {
 public:
  StereoCandidates(const FeatureSet& left, const FeatureSet& right, const Rig& rig,
                   const StereoMatchingOptions& options);

  // Right features within the epipolar gate of a left one and at a depth within the limits (a gate
  // beyond infinity included, so that a far point's true partner competes), ascending.
  void find(int left, std::vector<int>& candidates) const;

  const SE3& right_from_left() const { return right_from_left_; }
  const ObservedRay& left_ray(int left) const { return left_rays_[left]; }
  // px, for a pair of features with these uncertainties.
  double gate(float left_sigma, float right_sigma) const;

 private:
  double plane_angle(const Eigen::Vector3d& direction) const;
  bool inverse_depth_possible(const Eigen::Vector3d& left_in_right, int right, double gate) const;
  void fill_buckets();

  const FeatureSet& left_;
  const FeatureSet& right_;
  const StereoMatchingOptions& options_;
  SE3 right_from_left_;
  Eigen::Vector3d axis_, zero_, quarter_;  // of the plane angle
  double pixels_per_depth_;                // of inverse depth: focal length times baseline
  std::vector<ObservedRay> left_rays_;
  std::vector<ObservedRay> right_rays_;
  std::vector<int> starts_;   // of each bucket in indices_, plus the end
  std::vector<int> indices_;  // right features, by bucket
};

}  // namespace rover
