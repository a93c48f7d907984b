#pragma once

#include "rover/map/shared_map.h"
#include "rover/slam/config.h"

namespace rover {

// The adjustment of a whole map at the end: of poses and landmarks, and with inertial data that
// have been aligned to the map, also of velocities, biases, scale and gravity (then the newest
// `final.max_inertial_keyframes`; older ones move along).
void adjust_finally(SharedMap& map, const Config& config);

}  // namespace rover
