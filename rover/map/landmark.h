#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "rover/base/ids.h"
#include "rover/geometry/se3.h"
#include "rover/matching/patch_slant.h"

namespace rover {

// What a landmark looks like, taken from its reference observation. Immutable.
struct Appearance {
  Eigen::VectorXf descriptor;  // unit norm
  bool has_patch = false;      // false: the reference lies too close to the image's border
  ReferencePatch patch;
  // Unit rays (reference camera's frame) through the patch's centre and through the points one
  // pixel to its right and below: they give the warp of the patch into another image.
  Eigen::Vector3d ray, ray_right, ray_down;
};

struct LandmarkObservation {
  KeyframeId keyframe;
  int feature = -1;  // of that keyframe

  bool operator==(const LandmarkObservation&) const = default;
};

// A point of the world.
struct Landmark {
  LandmarkId id;
  Eigen::Vector3d position;                       // m (mono: map units), world frame
  std::vector<LandmarkObservation> observations;  // ascending keyframe, one per keyframe
  std::shared_ptr<const Appearance> appearance;
  Slant slant;               // of the patch, as learned from views from elsewhere
  SE3 world_from_reference;  // camera 0 at the reference observation, when it was made
  KeyframeId created_by;     // the newest keyframe when it was made
  int visible = 0;           // frames in which it should have been seen ...
  int found = 0;             // ... and was

  bool has_observation(KeyframeId keyframe) const;
};

}  // namespace rover
