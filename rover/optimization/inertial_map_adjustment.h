#pragma once

#include <vector>

#include "rover/optimization/inertial_bundle_adjustment.h"
#include "rover/optimization/map_adjustment.h"

namespace rover {

// A part of an aligned map as a visual-inertial adjustment problem, with the way back.
struct InertialMapProblem {
  MapProblem map;  // who is who; its bundle is part of `inertial`
  InertialBundleProblem inertial;
};

// At most `most` keyframes in time, up to and with one, newest first.
std::vector<KeyframeId> keyframes_backwards(const Map& map, KeyframeId from, int most);

// The last `window` keyframes in time, up to and with `newest`, are free; the pose before them and
// at most `max_fixed` other keyframes that see their landmarks are fixed. Velocity and biases
// before the window are free, too, with what was known of them before. Where nothing lies before
// the window, no state is fixed.
InertialMapProblem gather_inertial_window(const Map& map, KeyframeId newest, int window,
                                          int max_fixed, const WeightingOptions& weighting);

// The newest keyframes and the landmarks they see, all free: of a map of `most` keyframes or fewer
// all of it.
InertialMapProblem gather_newest(const Map& map, int most, const WeightingOptions& weighting);

// Whether no state is fixed: an adjustment may change scale and tilt.
bool is_free(const InertialMapProblem& problem);

// commit_adjustment with velocities, biases and what the adjustment tells of covariances. Where no
// state was fixed, scale and tilt of the map may have changed: keyframes and landmarks older than
// the problem move along with its oldest keyframe, and poses kept relative to keyframes follow
// (Map::rescale).
void commit_inertial_adjustment(Map& map, const InertialMapProblem& problem,
                                const InertialBundleSummary& summary);

// By how much the ways from keyframe to keyframe have grown.
double scale_change(const MapProblem& problem);

}  // namespace rover
