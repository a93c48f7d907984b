#pragma once

#include "rover/map/map.h"
#include "rover/matching/patch_slant.h"

namespace rover {

// Learns how the patches of the landmarks lean that a keyframe sees from elsewhere, and refines
// what it sees of them anew. Returns how many were learned. Needs the keyframe's image.
int learn_slants(Map& map, KeyframeId keyframe, const SlantOptions& options,
                 const PatchRefinementOptions& refinement);

}  // namespace rover
