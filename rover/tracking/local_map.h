#pragma once

#include <vector>

#include "rover/map/map.h"

namespace rover {

struct LocalMapOptions {
  int max_keyframes = 20;    // observers of what the frame sees, most first
  int recent_keyframes = 3;  // of the newest ones, always
  int near_keyframes = 5;    // of those that were about where the frame is and looked that way, ...
  double near_distance = 0.3;  // ... no farther away than this share of the landmarks' distance
  double near_angle = 30;      // ... and turned by no more than this, deg

  void check() const;
};

// The part of the map that a frame may see.
struct LocalMap {
  KeyframeId reference;               // shares most landmarks with the frame
  std::vector<LandmarkId> landmarks;  // ascending
};

// Picked afresh for every frame: observers of the landmarks seen in it, their parents and children
// in the spanning tree, the newest keyframes, and others nearby: on old ground, where as yet nothing
// that is seen links the frame to them, their landmarks are looked for rather than made anew.
// `fallback` is the reference when nothing votes.
LocalMap choose_local_map(const Map& map, const Frame& frame, KeyframeId fallback,
                          const LocalMapOptions& options);

}  // namespace rover
