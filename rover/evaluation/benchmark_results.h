#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace rover {

// A figure that benchmarks compare.
struct FigureKind {
  const char* key;      // in results.csv and results.json
  const char* label;    // for people, with the unit
  int decimals;         // for people
  bool more_is_better;  // so the worst is the least
};
std::span<const FigureKind> figure_kinds();
const FigureKind& figure_kind(const std::string& key);

// Figures of one run by key: those of figure_kinds, and stage.NAME.median, stage.NAME.p95 in ms.
// One that the run did not give is absent.
using Figures = std::map<std::string, double>;

// From summary.json and evaluation.json (null: there is none).
Figures figures_of_run(const nlohmann::json& summary, const nlohmann::json& evaluation);
// Of one of the trajectories in evaluation.json only.
Figures figures_of_trajectory(const nlohmann::json& evaluation, const std::string& trajectory);

// What is compared: a sequence in a mode with a configuration, or by another program.
struct CellName {
  std::string sequence, mode, configuration;
  auto operator<=>(const CellName&) const = default;
};

struct BenchmarkRun {
  CellName cell;
  std::uint64_t seed = 0;
  int repetition = 0;   // from 1
  std::string folder;   // of its files, relative to the benchmark's
  std::string failure;  // empty: it ended well
  Figures figures;
};

// One figure over the runs of a cell that gave it.
struct FigureSummary {
  std::size_t count = 0;
  double median = 0;
  double worst = 0;
};

struct BenchmarkCell {
  CellName name;
  std::size_t runs = 0;
  std::size_t failed = 0;
  std::map<std::string, FigureSummary> figures;
};

// In the order in which the cells first appear.
std::vector<BenchmarkCell> summarize(const std::vector<BenchmarkRun>& runs);

// Rows of text for people, the first one with the names of the configurations: ATE of every
// sequence and mode; and all figures and stages of one sequence and mode.
using TableRows = std::vector<std::vector<std::string>>;
TableRows side_by_side(const std::vector<BenchmarkCell>& cells);
TableRows figure_rows(const std::vector<BenchmarkCell>& cells_of_one);
TableRows stage_rows(const std::vector<BenchmarkCell>& cells_of_one);

// The cells of each sequence and mode together.
std::vector<std::vector<BenchmarkCell>> by_sequence(const std::vector<BenchmarkCell>& cells);

// All of that as text.
std::string format_benchmark(const std::vector<BenchmarkCell>& cells);
// One line per run.
std::string benchmark_csv(const std::vector<BenchmarkRun>& runs);
// Cells and runs.
nlohmann::ordered_json benchmark_json(const std::vector<BenchmarkRun>& runs);

// "median (worst)", one number where they are the same, "-" where no run gave the figure.
std::string format_summary(const BenchmarkCell& cell, const FigureKind& kind);

}  // namespace rover
