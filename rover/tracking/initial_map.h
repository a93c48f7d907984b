#pragma once

#include "rover/map/map.h"
#include "rover/optimization/map_adjustment.h"
#include "rover/tracking/mono_initializer.h"

namespace rover {

// Builds a monocular map of two views: keyframes and landmarks, observations refined, both adjusted
// together, scaled so that the median depth in the first view is 1. Returns the second keyframe, or
// an invalid id (and an unusable map) if less than `min_landmarks` survive.
KeyframeId build_initial_map(Map& map, InitialViews views, int min_landmarks,
                             const PatchRefinementOptions& refinement,
                             const WeightingOptions& weighting, const BundleOptions& adjustment);

}  // namespace rover
