#pragma once

#include "rover/optimization/inertial_map_adjustment.h"

namespace rover {

// Keeps with the keyframes how well their states are known, after an adjustment that told. That of
// a window tells it of its newest state, given the states it held fixed: their drift, averaged by
// what they share with the window (no less than that of the average, whatever their correlation),
// and its own make the drift of the newest. It is no less than that of the keyframe before, unless
// the window is tied to keyframes that are seconds older than that one's: a revisit.
void keep_covariances(Map& map, const InertialMapProblem& problem,
                      const InertialBundleSummary& summary);

}  // namespace rover
