#pragma once

#include <vector>

#include "rover/map/frame.h"

namespace rover {

enum class Prefer { kWithLandmark, kWithoutLandmark };

// The share (0 to 1] of a frame's features that a matcher is to be given: those preferred first, of
// either kind the best. Ascending.
std::vector<int> choose_features(const Frame& frame, double share, Prefer preferred);

}  // namespace rover
