#include "rover/cli/program.h"

#include <algorithm>
#include <exception>
#include <iostream>
#include <string>

#include <fmt/format.h>

#include "rover/base/error.h"
#include "rover/cli/commands.h"

namespace rover {
namespace {

constexpr int kInternalError = 1;
constexpr int kUserError = 2;

constexpr auto kCommands = {add_run,   add_evaluate, add_benchmark,
                            add_match, add_simulate, add_check};

std::string on_one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

int fail(int status, const std::string& message) {
  std::cerr << fmt::format("rover: {}\n", on_one_line(message));
  return status;
}

int parse_and_run(CLI::App& program, int argc, const char* const* argv) {
  try {
    program.parse(argc, argv);
    // Not by require_subcommand, which would hide the name of an unknown one.
    if (!program.get_subcommands().empty()) return 0;
    return fail(kUserError, "a subcommand is required; see rover --help");
  } catch (const CLI::RuntimeError& error) {  // a command's own exit status
    return error.get_exit_code();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return program.exit(error);  // --help, --version
    return fail(kUserError, fmt::format("{}; see rover --help", error.what()));
  }
}

}  // namespace

int run_program(int argc, const char* const* argv) {
  try {
    CLI::App program("Visual and visual-inertial SLAM on learned features", "rover");
    program.set_version_flag("--version", "rover " ROVER_VERSION);
    for (const auto add_command : kCommands) add_command(program);
    return parse_and_run(program, argc, argv);
  } catch (const InputError& error) {
    return fail(kUserError, error.what());
  } catch (const std::exception& error) {
    return fail(kInternalError, fmt::format("internal error: {}", error.what()));
  }
}

}  // namespace rover
