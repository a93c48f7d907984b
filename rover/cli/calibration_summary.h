#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "rover/map/map.h"
#include "rover/slam/config.h"

namespace rover {

// What a summary says of the calibration between cameras and inertial sensor that was estimated:
// values in force at the end, standard deviations, and how they came about.
nlohmann::ordered_json describe_calibration(const Map& map, const Config& config);

// The same in lines for people.
std::string calibration_for_people(const nlohmann::ordered_json& calibration);

}  // namespace rover
