#pragma once

#include <span>

#include "rover/map/map.h"
#include "rover/slam/final_trajectory.h"

namespace rover {

// Moves the frames between two keyframes of an aligned map to where the inertial data between them
// and their tracked poses together put them (all are normal with the covariances stated). Keyframes
// stay. Nothing moves between keyframes that are far apart in time, where inertial data contradict
// them, and in maps without any. `poses` in time order, `tracked` beside them (see PlacedFrame).
void smooth_between_keyframes(const Map& map, std::span<FinalPose> poses,
                              std::span<const Matrix6d> tracked);

}  // namespace rover
