// rover benchmark: sequences x modes x configurations x seeds in one go.

#include <iostream>
#include <memory>

#include <CLI/CLI.hpp>

#include "rover/cli/benchmark_runner.h"
#include "rover/cli/commands.h"
#include "rover/datasets/atomic_file.h"
#include "rover/evaluation/benchmark_page.h"

namespace rover {
namespace {

struct BenchmarkCommand {
  std::string file;
  BenchmarkOptions options;
};

void benchmark(BenchmarkCommand command) {
  const BenchmarkPlan plan = read_benchmark_plan(command.file);
  if (command.options.output.empty()) command.options.output = plan.output;
  if (command.options.output.empty()) {
    command.options.output = plan.file.stem().string() + "-benchmark";
  }
  const auto runs = BenchmarkRunner(plan, command.options).execute();
  const auto& folder = command.options.output;
  write_file_atomically(folder / "index.html",
                        benchmark_page(plan.file.stem().string(), folder, runs));
  std::cout << format_benchmark(summarize(runs)) << "\nwritten to "
            << (folder / "index.html").string() << '\n';
}

}  // namespace

void add_benchmark(CLI::App& program) {
  const auto command = std::make_shared<BenchmarkCommand>();
  BenchmarkOptions& options = command->options;
  CLI::App* app = program.add_subcommand(
      "benchmark", "Run sequences x modes x configurations x seeds and compare them");
  app->add_option("FILE", command->file, "YAML file; see docs/evaluation.md")->required();
  app->add_option("--output", options.output,
                  "folder for runs and tables (what the file says, else NAME-benchmark)");
  app->add_option("--jobs", options.jobs, "runs at a time (1); times are only true with 1");
  app->add_option("--only", options.only,
                  "only what has this in SEQUENCE/MODE/CONFIGURATION, or fits it with * and ?; may "
                  "be given again");
  app->add_option("--program", options.program, "the rover to be run (this one)");
  app->add_flag("--any-build", options.any_build,
                "keep finished runs although the program has changed since");
  app->callback([command] { benchmark(*command); });
}

}  // namespace rover
