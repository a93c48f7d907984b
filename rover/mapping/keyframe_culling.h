#pragma once

#include "rover/map/map.h"

namespace rover {

// Whether a keyframe adds nothing that others do not have: `share` of its landmarks are seen by at
// least three other keyframes. The first keyframe of a map, the newest ones and those with children
// made just now never are. `newest`: the keyframe being mapped.
bool is_redundant(const Map& map, KeyframeId candidate, KeyframeId newest, double share);

// How far apart in time culling may leave keyframes, s: inertial data say less the longer they are
// integrated.
struct CullingGaps {
  // Where more hangs on inertial data: with one camera, whose scale they alone tell, and at
  // keyframes with few landmarks.
  double close = 0.2;
  int sparse_landmarks = 100;  // fewer are few
  double recent = 0.5;         // between keyframes of the last `window` in time
  double old = 3;              // between others ...
  double settled = 60;  // ... that are not older than this, s: so long ago, vision alone holds them
  int window = 15;

  void check() const;
};

// Whether culling a keyframe would leave too long a gap in time. `newest`: the keyframe being
// mapped. Where a place is seen over and over, the map stays as large as the place needs. Before a
// map is aligned, all its keyframes count as recent.
bool leaves_gap(const Map& map, KeyframeId candidate, KeyframeId newest, const CullingGaps& gaps);

}  // namespace rover
