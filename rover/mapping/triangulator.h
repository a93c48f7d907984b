#pragma once

#include <memory>
#include <vector>

#include "rover/map/map.h"
#include "rover/matching/matcher.h"
#include "rover/optimization/map_adjustment.h"

namespace rover {

struct LandmarkCreationOptions {
  int neighbours = 3;          // keyframes matched with the new one ...
  int learned_neighbours = 1;  // ... the best so many of them by the learned matcher
  double matched_share = 0.6;  // of a keyframe's features that the matcher is given
  double min_baseline = 0.01;  // of the median depth: nearer keyframes give no depth
  double good_parallax = 5;    // deg between two views: more makes no better neighbour
  double min_parallax = 1.0;   // deg between the two rays of a new landmark
  double chi2 = 5.991;         // gate of the reprojection error ...
  WeightingOptions weighting;  // ... normalised by this
  PatchRefinementOptions refinement;

  void check() const;
};

// A keyframe's features joined to a neighbour's.
struct NeighbourMatches {
  KeyframeId neighbour;
  std::vector<Match> matches;  // a: of the new keyframe, b: of the neighbour
};

struct TriangulationCounts {
  int created = 0;
  int joined = 0;  // observations added to landmarks that were there
  int fused = 0;

  TriangulationCounts& operator+=(const TriangulationCounts& other) {
    created += other.created;
    joined += other.joined;
    fused += other.fused;
    return *this;
  }
};

// The covisible keyframes that promise most: many landmarks in common and much parallax. Where too
// few have landmarks in common, those just before in time: when a view is lost it is they that show
// the new one.
std::vector<KeyframeId> choose_neighbours(const Map& map, KeyframeId keyframe,
                                          const LandmarkCreationOptions& options);

// Joins a keyframe's features to a neighbour's. Only a share of them takes part, first those that
// have no landmark yet: they are what new landmarks are made of, and tracking has joined the
// others.
NeighbourMatches match_neighbour(const Map& map, KeyframeId keyframe, KeyframeId neighbour,
                                 const Matcher& matcher, const LandmarkCreationOptions& options);

// What the matches of a keyframe with a neighbour say of the map: two features without landmark
// make a new one (if their rays do), a landmark on one side is seen by the other too, two landmarks
// are one. Everything is checked by parallax and reprojection.
TriangulationCounts apply_matches(Map& map, KeyframeId keyframe, const NeighbourMatches& matches,
                                  const LandmarkCreationOptions& options,
                                  std::vector<LandmarkId>& created);

}  // namespace rover
