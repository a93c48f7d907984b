#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "rover/base/ids.h"
#include "rover/base/timestamp.h"
#include "rover/features/feature_set.h"
#include "rover/geometry/se3.h"

namespace rover {

// What is known of one feature of a frame.
struct Observation {
  LandmarkId landmark;    // invalid: not joined to one
  Eigen::Vector2f pixel;  // px, raw image of camera 0: the feature, or refined photometrically
  float sigma = 1;        // px, standard deviation per axis
  bool refined = false;   // photometrically; or the landmark's patch is from here
  bool stereo_rejected = false;  // the feature's stereo partner did not fit the landmark
};

// The partner of a feature in the right image (camera 1).
struct StereoObservation {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // px, raw image of camera 1
  float sigma = 0;                                  // px; 0: no partner
  Eigen::Vector3f point = Eigen::Vector3f::Zero();  // m, frame of camera 0
  float depth = 0;                                  // m, distance along the viewing ray
  float depth_sigma = 0;                            // m

  bool valid() const { return sigma > 0; }
};

// One instant as the rig saw it. Features and stereo partners are immutable and shared with the
// keyframe that may be made of the frame; observations and the pose are the frame's own.
struct Frame {
  FrameId id;
  Timestamp time = 0;
  SE3 world_from_body;
  std::shared_ptr<const FeatureSet> features;                    // of camera 0
  std::shared_ptr<const std::vector<StereoObservation>> stereo;  // one per feature; null: mono
  std::vector<Observation> observations;                         // one per feature
  cv::Mat image;  // camera 0; released when no refinement will ask for it any more

  int size() const { return static_cast<int>(observations.size()); }
  const StereoObservation* stereo_of(int feature) const {
    if (!stereo || !(*stereo)[static_cast<std::size_t>(feature)].valid()) return nullptr;
    return &(*stereo)[static_cast<std::size_t>(feature)];
  }
  // px, of a feature with a partner: its place in camera 1's raw image less that in camera 0's,
  // both as detected. Photometric refinement moves an observation, and its point with it, not this.
  Eigen::Vector2f disparity(int feature) const {
    const auto i = static_cast<std::size_t>(feature);
    return (*stereo)[i].pixel - features->positions[i];
  }
  const Observation& operator[](int feature) const {
    return observations[static_cast<std::size_t>(feature)];
  }
  Observation& operator[](int feature) { return observations[static_cast<std::size_t>(feature)]; }

  // Parts a feature from its landmark. Its place is as detected again: the refined one was that of
  // the landmark's patch.
  void unjoin(int feature);
  // The landmarks that features are joined to, in the order of the features.
  std::vector<LandmarkId> landmarks() const;
  // Number of features joined to a landmark.
  int landmark_count() const;
};

}  // namespace rover
