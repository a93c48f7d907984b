#pragma once

#include <vector>

#include "rover/map/map.h"
#include "rover/optimization/inertial_initialization.h"

namespace rover {

// The newest keyframes that inertial data link without a break, in order of time; none that an
// initialisation was misled by.
std::vector<KeyframeId> linked_keyframes(const Map& map, KeyframeId newest, int most);

InitializationProblem gather_initialization(const Map& map, const std::vector<KeyframeId>& chain);

// Turns and scales a map, and gives its keyframes velocities and biases. Keyframes made since the
// initialisation was gathered follow the last one by integration.
void align(Map& map, const std::vector<KeyframeId>& chain, const InitializationResult& result);

}  // namespace rover
