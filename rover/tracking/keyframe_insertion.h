#pragma once

#include "rover/map/shared_map.h"

namespace rover {

struct StereoLandmarkOptions {
  double max_baselines = 40;        // depth in baselines up to which a stereo point is near
  double max_relative_sigma = 0.1;  // depth_sigma / depth: beyond, the point waits for parallax
  int min_landmarks = 100;          // when fewer are near, the nearest so many are taken

  void check() const;
};

// m; 0 for one camera.
double near_depth(const Rig& rig, const StereoLandmarkOptions& options);

// Whether a stereo point is near and certain enough to become a landmark.
bool is_near(const StereoObservation& stereo, double near_depth,
             const StereoLandmarkOptions& options);

// The first step of mapping: commits a frame as keyframe with its stereo landmarks. Returns its id.
KeyframeId insert_keyframe(Map& map, Frame frame, const StereoLandmarkOptions& options);

}  // namespace rover
