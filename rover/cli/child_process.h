#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace rover {

struct ChildOutcome {
  int status = 0;  // exit status; 128 + signal if a signal ended it
  double seconds = 0;

  bool ok() const { return status == 0; }
};

// Runs a program and waits for its end. What it prints is added to the end of `log`. The child ends
// when its parent does. May be called on several threads at once. Throws InputError if no process
// can be started.
ChildOutcome run_child(const std::filesystem::path& program,
                       const std::vector<std::string>& arguments, const std::filesystem::path& log);

}  // namespace rover
