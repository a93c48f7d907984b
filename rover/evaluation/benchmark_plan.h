#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace rover {

// Options of a command line without their dashes, in the order of the file. A flag that takes no
// value has none.
using CommandOptions = std::vector<std::pair<std::string, std::optional<std::string>>>;

// The same as arguments: --name value --flag ...
std::vector<std::string> to_arguments(const CommandOptions& options);

struct BenchmarkSequence {
  std::string name;
  std::filesystem::path dataset;           // empty: made by `rover simulate`
  std::optional<CommandOptions> simulate;  // its options; "$seed" stands for the seed
  std::vector<std::string> modes;
  std::vector<std::uint64_t> seeds;  // of the run, and of the simulation
  CommandOptions input;              // for run and evaluate: format, calibration
  CommandOptions run;                // for run only: mask, max-frames, frame-rate
};

struct BenchmarkConfiguration {
  std::string name;
  std::string settings;  // YAML as `rover run --config` reads it; may be empty
  CommandOptions flags;  // of `rover run`
  int line = 0;          // in the file, for messages
};

// What another program made of a sequence: a trajectory in TUM format.
struct OtherProgram {
  std::string name;
  std::string sequence;
  std::string mode;
  std::filesystem::path trajectory;
};

// What `rover benchmark` is to do: each sequence in each of its modes with each configuration, for
// each seed, `repetitions` times.
struct BenchmarkPlan {
  std::filesystem::path file;
  std::filesystem::path output;  // empty: not said
  int repetitions = 1;
  std::vector<BenchmarkSequence> sequences;
  std::vector<BenchmarkConfiguration> configurations;
  std::vector<OtherProgram> others;
};

// docs/evaluation.md describes the format. Paths are relative to the file. Throws InputError with
// file and line for keys that are not known, values of the wrong kind, names that are missing,
// given twice or no good for a folder, and files that are not there.
BenchmarkPlan read_benchmark_plan(const std::filesystem::path& file);

}  // namespace rover
