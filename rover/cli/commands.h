#pragma once

#include <CLI/CLI.hpp>

namespace rover {

// Each adds one subcommand, in a file of its own. Its callback does the work and throws InputError
// for what the user can mend.
void add_run(CLI::App& program);
void add_evaluate(CLI::App& program);
void add_benchmark(CLI::App& program);
void add_match(CLI::App& program);
void add_simulate(CLI::App& program);
void add_check(CLI::App& program);

}  // namespace rover
