#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <iostream>

#include "rover/base/error.h"

namespace rover {

// What is left of a program's main once its options are named: reads them and does the work.
// Returns the exit status, 2 with a line on stderr for input that is bad.
inline int parse_and_run(CLI::App& app, int argc, char** argv, const std::function<void()>& work) {
  CLI11_PARSE(app, argc, argv);
  try {
    work();
  } catch (const InputError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
  return 0;
}

}  // namespace rover
