#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rover/cli/program.h"
#include "rover/networks/runtime.h"

namespace rover {

// What a call of the program left.
struct Outcome {
  int status = 0;
  std::string out, err;
};

// Calls the program as main() does. arguments: those behind its name.
inline Outcome call_program(const std::vector<std::string>& arguments) {
  std::vector<const char*> argv = {"rover"};
  for (const auto& argument : arguments) argv.push_back(argument.c_str());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  Outcome outcome;
  outcome.status = run_program(static_cast<int>(argv.size()), argv.data());
  outcome.out = testing::internal::GetCapturedStdout();
  outcome.err = testing::internal::GetCapturedStderr();
  return outcome;
}

inline Outcome call_subcommand(const std::string& name, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), name);
  return call_program(arguments);
}

// Whether the default family's networks are on this machine.
inline bool have_models() {
  const auto folders = model_folders();
  return std::any_of(folders.begin(), folders.end(), [](const std::filesystem::path& folder) {
    return std::filesystem::exists(folder / "lighterglue.json");
  });
}

}  // namespace rover
