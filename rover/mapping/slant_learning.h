#pragma once

#include <vector>

#include "rover/map/map.h"
#include "rover/matching/patch_slant.h"

namespace rover {

// What a keyframe tells of how one landmark's patch leans.
struct LearnedSlant {
  LandmarkId landmark;
  Slant slant;
  int feature = -1;      // of the keyframe, joined to the landmark
  Observation observed;  // what the feature measures given the slant
};

// Learns how the patches of the landmarks lean that a keyframe sees from elsewhere, and refines
// what it sees of them anew. Needs the keyframe's image.
std::vector<LearnedSlant> learn_slants(const Map& map, KeyframeId keyframe,
                                       const SlantOptions& options,
                                       const PatchRefinementOptions& refinement);

// Writes them into the map, where the keyframe still sees these landmarks.
void commit_slants(Map& map, KeyframeId keyframe, const std::vector<LearnedSlant>& learned);

}  // namespace rover
