#pragma once

#include <vector>

#include "rover/map/map.h"

namespace rover {

struct LocalMapOptions {
  int max_keyframes = 20;    // observers of what the frame sees, most first
  int recent_keyframes = 3;  // of the newest ones, always

  void check() const;
};

// The part of the map that a frame may see.
struct LocalMap {
  KeyframeId reference;               // shares most landmarks with the frame
  std::vector<LandmarkId> landmarks;  // ascending
};

// Picked afresh for every frame: observers of the landmarks seen in it, their parents and children
// in the spanning tree, and the newest keyframes. `fallback` is the reference when nothing votes.
LocalMap choose_local_map(const Map& map, const Frame& frame, KeyframeId fallback,
                          const LocalMapOptions& options);

}  // namespace rover
