#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "rover/cli/run_recorder.h"
#include "rover/slam/system.h"

namespace rover {

// What a summary says of inertial initialisation: `state` (aligned, or waiting for excitation with
// what is missing), when it was aligned, how well the scale is known, how often it was undone.
nlohmann::ordered_json describe_inertia(const System& system, const RunRecorder& recorder);

// The same as a line for people.
std::string inertia_for_people(const nlohmann::ordered_json& inertial);

}  // namespace rover
