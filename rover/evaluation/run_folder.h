#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
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
  std::vector<double> times;  // in the order of the file
};

// A line of frames.csv. A count that the file does not have is 0.
struct FrameLine {
  Timestamp time = 0;
  std::string state;
  double features = 0, matches = 0, inliers = 0;
  double frame_ms = 0;  // 0: the frame was not worked on
  double rss_mb = 0;
  double map = 0, epoch = 0;  // which map, and how often its gauge had changed
};

// A line of states.csv: velocity (world, m/s), gyroscope bias (rad/s), accelerometer bias (m/s^2)
// and the standard deviations of all.
struct StateLine {
  Timestamp time = 0;
  std::array<double, 9> values = {};
  std::array<double, 9> sigmas = {};
};

// A picture of a frame with its features.
struct SamplePicture {
  Timestamp time = 0;
  std::filesystem::path file;
};

// The files that `rover run` leaves in its output folder.
struct RunFolder {
  std::string mode;        // mono, stereo, mono-inertial, stereo-inertial
  std::string pose_frame;  // cam0, body
  Trajectory final;
  Trajectory causal;                   // may be empty
  Trajectory odometry;                 // may be empty
  Trajectory keyframes;                // may be empty
  std::vector<FrameLine> frames;       // in the order of frames.csv
  std::vector<StateLine> motion;       // of inertial runs; may be empty
  std::vector<SamplePicture> samples;  // in the order of time; may be empty
  Offered offered;                     // from frames.csv
  std::map<std::string, int> states;   // of frames.csv -> frames
  std::vector<StageTiming> stages;     // in the order of timing.csv
  nlohmann::ordered_json summary;
  std::vector<std::string> notes;  // what could not be read

  // Seconds from the first frame offered to the first one with a pose of its own at once.
  std::optional<double> initialised_after() const;
  bool monocular() const { return mode == "mono"; }
  bool inertial() const { return mode.ends_with("-inertial"); }
};

// Throws InputError if a file is missing or broken, or the run tracked nothing.
RunFolder read_run_folder(const std::filesystem::path& folder);

}  // namespace rover
