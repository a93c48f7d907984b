#pragma once

#include <string>

#include "rover/evaluation/chart.h"
#include "rover/evaluation/run_folder.h"

namespace rover {

// What an inertial run says of velocity and biases over time, and when scale and gravity were
// found, as a part of a report. `empty` is a chart without series; its x counts seconds from the
// first frame offered. Nothing for runs without such states.
std::string inertial_section(const RunFolder& run, const Chart& empty);

}  // namespace rover
