#pragma once

#include <span>
#include <vector>

#include "rover/map/map.h"
#include "rover/map/visibility.h"
#include "rover/matching/guided_matching.h"

namespace rover {

struct LandmarkSearchOptions {
  float radius = 8;            // px, of the gate around the projection
  double max_view_angle = 60;  // deg between the viewing ray and the reference one
  GuidedMatchingOptions guided;

  void check() const;
};

// Step 2 of the pipeline, matching by projection: looks for landmarks of a map in a frame whose
// pose is known roughly, and joins the frame's free features to those found. Landmarks that the
// frame sees already are passed over. `sought`, if given, receives the landmarks that were expected
// inside the image. Returns how many were joined.
int search_landmarks(const Map& map, std::span<const LandmarkId> landmarks,
                     const LandmarkSearchOptions& options, const FeatureGrid& grid, Frame& frame,
                     std::vector<LandmarkId>* sought = nullptr);

// Refines every joined observation of a frame photometrically where that converges; returns how
// many did.
int refine_observations(const Map& map, const PatchRefinementOptions& options, Frame& frame);

}  // namespace rover
