#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "rover/datasets/trajectory.h"
#include "rover/evaluation/judgement.h"

namespace rover {

// Times of one stage, in ms.
struct StageTiming {
  std::string stage;
  std::size_t count = 0;
  double median = 0, p95 = 0, max = 0;
};

// The files that `rover run` leaves in its output folder.
struct RunFolder {
  std::string mode;        // mono, stereo, mono-inertial, stereo-inertial
  std::string pose_frame;  // cam0, body
  Trajectory final;
  Trajectory causal;                  // may be empty
  Offered offered;                    // from frames.csv
  std::map<std::string, int> states;  // of frames.csv -> frames
  std::vector<StageTiming> stages;    // in the order of timing.csv
  nlohmann::ordered_json summary;
  std::vector<std::string> notes;  // what could not be read

  bool monocular() const { return mode == "mono"; }
  bool inertial() const { return mode.ends_with("-inertial"); }
};

// Throws InputError if a file is missing or broken, or the run tracked nothing.
RunFolder read_run_folder(const std::filesystem::path& folder);

}  // namespace rover
