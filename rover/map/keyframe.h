#pragma once

#include <vector>

#include "rover/map/frame.h"

namespace rover {

// A frame that the map keeps.
struct Keyframe {
  KeyframeId id;
  KeyframeId parent;  // in the spanning tree: most landmarks in common when it was made; invalid
                      // for the first keyframe of a map
  std::vector<KeyframeId> children;  // ascending
  Frame frame;

  const SE3& world_from_body() const { return frame.world_from_body; }
};

}  // namespace rover
