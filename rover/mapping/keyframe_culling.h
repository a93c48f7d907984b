#pragma once

#include "rover/map/map.h"

namespace rover {

// Whether a keyframe adds nothing that others do not have: `share` of its landmarks are seen by at
// least three other keyframes. The first keyframe of a map, the newest ones and those with children
// made just now never are. `newest`: the keyframe being mapped.
bool is_redundant(const Map& map, KeyframeId candidate, KeyframeId newest, double share);

}  // namespace rover
