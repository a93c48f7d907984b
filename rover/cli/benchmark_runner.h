#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "rover/evaluation/benchmark_plan.h"
#include "rover/evaluation/benchmark_results.h"

namespace rover {

struct BenchmarkOptions {
  std::filesystem::path output;
  std::filesystem::path program = "/proc/self/exe";  // the rover that runs and evaluates
  int jobs = 1;                                      // runs at a time
  // Do only what one of these fits, all without any: a part of SEQUENCE/MODE/CONFIGURATION, or a
  // pattern with * and ? for the whole of it or for the sequence.
  std::vector<std::string> only;
  bool any_build = false;  // what another build of the program has finished counts as well

  void check() const;
};

// Does what a plan says, each run in a process of its own: one that crashes is a line in the table.
// A run whose folder holds a stamp with the same inputs (dataset, options, settings, seed, and the
// program, byte for byte) is not done again, so that an interrupted benchmark goes on.
//
//   OUTPUT/configurations/NAME.yaml
//   OUTPUT/sequences/NAME-SEED/                                  simulated
//   OUTPUT/runs/SEQUENCE/MODE/CONFIGURATION/seedS.R/             as of `rover run` and `evaluate`
//   OUTPUT/runs/SEQUENCE/MODE/CONFIGURATION/seedS.R/log.txt
class BenchmarkRunner {
 public:
  // Throws InputError for settings that make no sense and an output that cannot be written.
  BenchmarkRunner(const BenchmarkPlan& plan, const BenchmarkOptions& options);

  // Tells on standard error how it goes. After each run the text, CSV and JSON of what is known so
  // far is in OUTPUT/results.*.
  std::vector<BenchmarkRun> execute();

 private:
  struct Task {
    BenchmarkRun run;
    const BenchmarkSequence* sequence = nullptr;
    const BenchmarkConfiguration* configuration = nullptr;
    std::filesystem::path dataset;
  };

  void write_configurations() const;
  std::vector<Task> list_tasks();
  void add_runs(const BenchmarkSequence& sequence, const std::string& mode,
                const BenchmarkConfiguration& configuration, std::vector<Task>& tasks);
  bool wanted(const CellName& cell) const;
  // The folder of a sequence, made if it has to be; a reason in `failure` if that does not work.
  std::filesystem::path provide(const BenchmarkSequence& sequence, std::uint64_t seed,
                                std::string& failure);
  void perform(Task& task) const;
  bool run(Task& task) const;
  void evaluate(Task& task) const;
  std::vector<std::string> run_arguments(const Task& task) const;
  std::vector<std::string> evaluate_arguments(const Task& task) const;
  nlohmann::json inputs_of(const std::vector<std::string>& arguments, bool with_program) const;
  bool finished(const std::filesystem::path& stamp, const nlohmann::json& inputs) const;
  std::vector<BenchmarkRun> results(const std::vector<Task>& tasks, std::size_t known) const;
  std::vector<BenchmarkRun> judged_others(const std::vector<Task>& tasks) const;
  void write_results(const std::vector<BenchmarkRun>& runs) const;

  const BenchmarkPlan& plan_;
  BenchmarkOptions options_;
  std::string build_;  // fingerprint of the program
  // (sequence, seed) -> its folder and, if it could not be made, why.
  std::map<std::pair<std::string, std::uint64_t>, std::pair<std::filesystem::path, std::string>>
      sequences_;
};

}  // namespace rover
