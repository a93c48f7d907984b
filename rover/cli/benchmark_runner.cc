#include "rover/cli/benchmark_runner.h"

#include <fnmatch.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <functional>
#include <iostream>
#include <thread>

#include <fmt/format.h>

#include "rover/base/error.h"
#include "rover/base/random.h"
#include "rover/cli/child_process.h"
#include "rover/datasets/atomic_file.h"
#include "rover/datasets/text_rows.h"
#include "rover/slam/config.h"

namespace rover {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Arguments = std::vector<std::string>;

// A hash of a file's bytes; empty for what is no file.
std::string fingerprint(const fs::path& file) {
  if (!fs::is_regular_file(file)) return "";
  std::ifstream stream(file, std::ios::binary);
  std::uint64_t hash = 0;
  std::vector<std::uint64_t> words(1 << 16);
  do {
    std::fill(words.begin(), words.end(), 0);
    stream.read(reinterpret_cast<char*>(words.data()),
                static_cast<std::streamsize>(words.size() * sizeof(words[0])));
    const auto bytes = static_cast<std::uint64_t>(stream.gcount());
    for (std::size_t i = 0; i * sizeof(words[0]) < bytes; ++i) hash = hash_seed(hash, words[i]);
    hash = hash_seed(hash, bytes);
  } while (stream);
  return fmt::format("{:016x}", hash);
}

Json read_json_if_any(const fs::path& file) {
  if (!fs::exists(file)) return nullptr;
  return Json::parse(read_text_file(file), nullptr, false);
}

void append(const Arguments& more, Arguments& arguments) {
  arguments.insert(arguments.end(), more.begin(), more.end());
}

// What the program said last, or how it ended.
std::string reason(const ChildOutcome& outcome, const fs::path& log) {
  constexpr std::string_view kSaid = "rover: ";
  if (outcome.status > 128) return fmt::format("ended by signal {}", outcome.status - 128);
  std::ifstream lines(log);
  std::string line, message = fmt::format("ended with status {}", outcome.status);
  while (std::getline(lines, line)) {
    if (line.starts_with(kSaid)) message = line.substr(kSaid.size());
  }
  return message;
}

void make_empty_folder(const fs::path& folder) {
  std::error_code error;
  fs::remove_all(folder, error);
  fs::create_directories(folder, error);
  require(!error, "{}: cannot be made ({})", folder.string(), error.message());
}

std::string figure_text(const Figures& figures, const char* key, const char* format,
                        double factor = 1) {
  const auto found = figures.find(key);
  if (found == figures.end()) return "-";
  return fmt::format(fmt::runtime(format), factor * found->second);
}

std::string outcome_text(const BenchmarkRun& run) {
  if (!run.failure.empty()) return "failed: " + run.failure;
  return fmt::format("coverage {}, ATE {}, frame {}",
                     figure_text(run.figures, "coverage", "{:.1f}%"),
                     figure_text(run.figures, "ate_rmse", "{:.4f} m"),
                     figure_text(run.figures, "frame_median", "{:.1f} ms"));
}

// The message of a settings file without its name, which the user has never seen.
std::string without_place(const std::string& message, const fs::path& file) {
  return message.starts_with(file.string()) ? message.substr(message.find(": ") + 2) : message;
}

}  // namespace

void BenchmarkOptions::check() const {
  require(jobs >= 1, "--jobs is {}; use 1 or more", jobs);
  require(fs::exists(program), "--program {}: no such file", program.string());
}

BenchmarkRunner::BenchmarkRunner(const BenchmarkPlan& plan, const BenchmarkOptions& options)
    : plan_(plan), options_(options), build_(fingerprint(options.program)) {
  options_.check();
  options_.output = fs::absolute(options_.output);
  std::error_code error;
  fs::create_directories(options_.output / "configurations", error);
  require(!error, "--output {}: cannot be written ({})", options_.output.string(), error.message());
  write_configurations();
}

void BenchmarkRunner::write_configurations() const {
  for (const BenchmarkConfiguration& configuration : plan_.configurations) {
    const fs::path file = options_.output / "configurations" / (configuration.name + ".yaml");
    write_file_atomically(file, configuration.settings);
    try {
      Config config;
      load_config(file, config);
    } catch (const InputError& problem) {
      throw InputError("{}:{}: configuration {}: {}", plan_.file.string(), configuration.line,
                       configuration.name, without_place(problem.what(), file));
    }
  }
}

std::vector<BenchmarkRun> BenchmarkRunner::execute() {
  std::vector<Task> tasks = list_tasks();
  std::atomic<std::size_t> next = 0;
  std::size_t done = 0;
  std::mutex mutex;
  const auto work = [&] {
    for (std::size_t i = next++; i < tasks.size(); i = next++) {
      Task task = tasks[i];
      perform(task);
      const std::lock_guard lock(mutex);
      tasks[i] = std::move(task);
      const BenchmarkRun& run = tasks[i].run;
      std::cerr << fmt::format("[{}/{}] {} {} {}, seed {}, run {}: {}\n", ++done, tasks.size(),
                               run.cell.sequence, run.cell.mode, run.cell.configuration, run.seed,
                               run.repetition, outcome_text(run));
      if (options_.jobs == 1) write_results(results(tasks, i + 1));
    }
  };
  std::vector<std::thread> threads;
  for (int i = 1; i < options_.jobs; ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  const auto runs = results(tasks, tasks.size());
  write_results(runs);
  return runs;
}

std::vector<BenchmarkRunner::Task> BenchmarkRunner::list_tasks() {
  std::vector<Task> tasks;
  for (const BenchmarkSequence& sequence : plan_.sequences) {
    for (const std::string& mode : sequence.modes) {
      for (const auto& configuration : plan_.configurations) {
        if (!wanted({sequence.name, mode, configuration.name})) continue;
        add_runs(sequence, mode, configuration, tasks);
      }
    }
  }
  require(!tasks.empty(), "--only: fits nothing in {}; it has sequences as {}", plan_.file.string(),
          plan_.sequences.front().name);
  return tasks;
}

bool BenchmarkRunner::wanted(const CellName& cell) const {
  const std::string whole = cell.sequence + "/" + cell.mode + "/" + cell.configuration;
  const auto fits = [&](const std::string& pattern) {
    return whole.find(pattern) != std::string::npos ||
           fnmatch(pattern.c_str(), whole.c_str(), 0) == 0 ||
           fnmatch(pattern.c_str(), cell.sequence.c_str(), 0) == 0;
  };
  return options_.only.empty() || std::any_of(options_.only.begin(), options_.only.end(), fits);
}

void BenchmarkRunner::add_runs(const BenchmarkSequence& sequence, const std::string& mode,
                               const BenchmarkConfiguration& configuration,
                               std::vector<Task>& tasks) {
  for (const std::uint64_t seed : sequence.seeds) {
    for (int repetition = 1; repetition <= plan_.repetitions; ++repetition) {
      Task task{{{sequence.name, mode, configuration.name}, seed, repetition, "", "", {}},
                &sequence,
                &configuration,
                ""};
      task.dataset = provide(sequence, seed, task.run.failure);
      task.run.folder = fmt::format("runs/{}/{}/{}/seed{}.{}", sequence.name, mode,
                                    configuration.name, seed, repetition);
      tasks.push_back(std::move(task));
    }
  }
}

fs::path BenchmarkRunner::provide(const BenchmarkSequence& sequence, std::uint64_t seed,
                                  std::string& failure) {
  if (!sequence.simulate) return sequence.dataset;
  auto& [folder, problem] = sequences_[{sequence.name, seed}];
  failure = problem;
  if (!folder.empty()) return folder;
  folder = options_.output / "sequences" / fmt::format("{}-{}", sequence.name, seed);
  CommandOptions simulate = *sequence.simulate;
  for (auto& [key, value] : simulate) {
    if (value == "$seed") value = std::to_string(seed);
  }
  Arguments arguments = {"simulate", "--output", folder.string(), "--seed", std::to_string(seed)};
  append(to_arguments(simulate), arguments);
  // Making one takes minutes and hardly changes with the program: any build's will do.
  const Json inputs = inputs_of(arguments, false);
  const fs::path stamp = folder.string() + ".stamp.json";
  if (finished(stamp, inputs) && fs::exists(folder)) return folder;
  std::cerr << fmt::format("making sequence {}, seed {}\n", sequence.name, seed);
  make_empty_folder(folder);
  fs::remove(folder);
  const fs::path log = folder.string() + ".log.txt";
  write_file_atomically(log, "");
  const ChildOutcome outcome = run_child(options_.program, arguments, log);
  if (outcome.ok()) {
    write_file_atomically(stamp, inputs.dump(2) + "\n");
  } else {
    failure = problem = "sequence was not made: " + reason(outcome, log);
  }
  return folder;
}

void BenchmarkRunner::perform(Task& task) const {
  if (!task.run.failure.empty()) return;
  try {
    if (!run(task)) return;
    evaluate(task);
    const fs::path folder = options_.output / task.run.folder;
    task.run.figures = figures_of_run(read_json_if_any(folder / "summary.json"),
                                      read_json_if_any(folder / "evaluation.json"));
  } catch (const InputError& error) {
    task.run.failure = error.what();
  }
}

bool BenchmarkRunner::run(Task& task) const {
  const fs::path folder = options_.output / task.run.folder;
  const Arguments arguments = run_arguments(task);
  Json inputs = inputs_of(arguments, true);
  const fs::path stamp = folder / "run.stamp.json";
  if (finished(stamp, inputs)) return true;
  make_empty_folder(folder);
  const fs::path log = folder / "log.txt";
  const ChildOutcome outcome = run_child(options_.program, arguments, log);
  if (!outcome.ok()) {
    task.run.failure = reason(outcome, log);
    return false;
  }
  inputs["seconds"] = outcome.seconds;
  write_file_atomically(stamp, inputs.dump(2) + "\n");
  return true;
}

void BenchmarkRunner::evaluate(Task& task) const {
  const fs::path folder = options_.output / task.run.folder;
  const Arguments arguments = evaluate_arguments(task);
  const Json inputs = inputs_of(arguments, true);
  const fs::path stamp = folder / "evaluate.stamp.json";
  if (finished(stamp, inputs)) return;
  fs::remove(folder / "evaluation.json");
  // Without ground truth there are no errors to report, but times and coverage.
  if (!run_child(options_.program, arguments, folder / "log.txt").ok()) return;
  write_file_atomically(stamp, inputs.dump(2) + "\n");
}

Arguments BenchmarkRunner::run_arguments(const Task& task) const {
  const auto& name = task.configuration->name;
  Arguments arguments = {"run",
                         "--dataset",
                         task.dataset.string(),
                         "--mode",
                         task.run.cell.mode,
                         "--output",
                         (options_.output / task.run.folder).string(),
                         "--config",
                         (options_.output / "configurations" / (name + ".yaml")).string(),
                         "--seed",
                         std::to_string(task.run.seed)};
  append(to_arguments(task.sequence->input), arguments);
  append(to_arguments(task.sequence->run), arguments);
  append(to_arguments(task.configuration->flags), arguments);
  return arguments;
}

Arguments BenchmarkRunner::evaluate_arguments(const Task& task) const {
  Arguments arguments = {"evaluate", "--run", (options_.output / task.run.folder).string(),
                         "--dataset", task.dataset.string()};
  append(to_arguments(task.sequence->input), arguments);
  for (const OtherProgram& other : plan_.others) {
    if (other.sequence != task.run.cell.sequence || other.mode != task.run.cell.mode) continue;
    append({"--peer", other.name + "=" + other.trajectory.string()}, arguments);
  }
  return arguments;
}

// Files that are named count with their content.
Json BenchmarkRunner::inputs_of(const Arguments& arguments, bool with_program) const {
  Json inputs = {{"arguments", arguments}, {"version", ROVER_VERSION}};
  if (with_program) inputs["build"] = build_;
  for (const std::string& argument : arguments) {
    const std::string file = argument.substr(argument.find('=') + 1);
    if (const std::string hash = fingerprint(file); !hash.empty()) inputs["files"][file] = hash;
  }
  return inputs;
}

bool BenchmarkRunner::finished(const fs::path& stamp, const Json& inputs) const {
  Json found = read_json_if_any(stamp);
  if (!found.is_object()) return false;
  found.erase("seconds");
  Json wanted = inputs;
  if (options_.any_build) {
    found.erase("build");
    wanted.erase("build");
  }
  return found == wanted;
}

std::vector<BenchmarkRun> BenchmarkRunner::results(const std::vector<Task>& tasks,
                                                   std::size_t known) const {
  std::vector<BenchmarkRun> runs;
  for (std::size_t i = 0; i < known; ++i) runs.push_back(tasks[i].run);
  const auto others = judged_others(tasks);
  runs.insert(runs.end(), others.begin(), others.end());
  return runs;
}

// Each was judged beside every run of its sequence and mode; the first one will do.
std::vector<BenchmarkRun> BenchmarkRunner::judged_others(const std::vector<Task>& tasks) const {
  std::vector<BenchmarkRun> runs;
  for (const OtherProgram& other : plan_.others) {
    for (const Task& task : tasks) {
      if (task.run.cell.sequence != other.sequence || task.run.cell.mode != other.mode) continue;
      const Json evaluation =
          read_json_if_any(options_.output / task.run.folder / "evaluation.json");
      Figures figures = figures_of_trajectory(evaluation, other.name);
      if (figures.empty()) continue;
      runs.push_back({{other.sequence, other.mode, other.name}, 0, 1, "", "", std::move(figures)});
      break;
    }
  }
  return runs;
}

void BenchmarkRunner::write_results(const std::vector<BenchmarkRun>& runs) const {
  write_file_atomically(options_.output / "results.txt", format_benchmark(summarize(runs)));
  write_file_atomically(options_.output / "results.csv", benchmark_csv(runs));
  write_file_atomically(options_.output / "results.json", benchmark_json(runs).dump(1) + "\n");
}

}  // namespace rover
