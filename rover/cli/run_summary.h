#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "rover/cli/run_recorder.h"
#include "rover/slam/system.h"

namespace rover {

// What a summary says beside what System and RunRecorder know.
struct RunFacts {
  Mode mode = Mode::kMono;
  std::filesystem::path dataset;
  bool realtime = false;
  std::size_t frames_offered = 0;
  double sensor_seconds = 0;       // from the first to the last stamp
  double wall_seconds = 0;         // of the run without the final adjustment
  double final_adjustment_ms = 0;  // 0: not asked for
  nlohmann::ordered_json input;    // what was wrong with it: InputTroubles
};

// Writes trajectory_final.txt (and .1, .2 ... for other maps), keyframes.txt, map.ply and
// summary.json, and returns the summary for people.
std::string write_results(const std::filesystem::path& folder, const System& system,
                          const RunRecorder& recorder, const RunFacts& facts);

// trajectory_before_adjustment.txt: the largest map before its final adjustment.
void write_unadjusted(const std::filesystem::path& folder, const System& system);

}  // namespace rover
