#pragma once

#include "rover/optimization/inertial_map_adjustment.h"

namespace rover {

// Keeps with the keyframes how well their states are known, after an adjustment that told.
//
// That of a window tells it of its newest state. The poses that it held fixed are off as a whole by
// their drift, averaged by what they share with the window (no less than that of the average,
// whatever their correlation): the newest state errs with it as the adjustment's response says, and
// by its own covariance besides. The drift in position and yaw is no less than that of the keyframe
// before would be in its place, unless it is a revisit.
//
// That of all states tells the drift of each anew. What a state was known to when it was the newest
// is kept, where that is known: it is the prior of windows that begin there. By `scale` the unit of
// length has changed.
void keep_covariances(Map& map, const InertialMapProblem& problem,
                      const InertialBundleSummary& summary, double scale);

// Whether a window is tied to keyframes that are seconds older than those of the window before
// (StateCovariance::anchor of both).
bool is_revisit(double anchor, double before);

// What is known of a keyframe's tilt, velocity and biases from before it; nothing where nothing is.
std::optional<StatePrior> prior_of(const Keyframe& keyframe);

}  // namespace rover
