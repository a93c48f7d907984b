#include "rover/evaluation/benchmark_results.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include <fmt/format.h>

#include "rover/evaluation/metrics.h"
#include "rover/evaluation/text_table.h"

namespace rover {
namespace {

using Json = nlohmann::json;
using Pointer = Json::json_pointer;

constexpr FigureKind kKinds[] = {
    {"coverage", "coverage [%]", 1, true},
    {"ate_rmse", "ATE rmse [m]", 4, false},
    {"ate_std", "ATE std [m]", 4, false},
    {"causal_ate_rmse", "causal ATE rmse [m]", 4, false},
    {"late_causal_ate", "late causal ATE SE(3) [m]", 4, false},
    {"early_scale_error", "causal scale error [%]", 2, false},
    {"final_scale_error", "final scale error [%]", 2, false},
    {"causal_step", "largest causal step [mm]", 1, false},
    {"odometry_step", "largest odometry step [mm]", 1, false},
    {"coverage_after", "coverage after the first pose [%]", 1, true},
    {"gap_ate", "ATE in dead reckoning [m]", 4, false},
    {"gap_drift", "largest drift in dead reckoning [m]", 4, false},
    {"rpe_rmse", "RPE rmse [mm]", 2, false},
    {"rpe_std", "RPE std [mm]", 2, false},
    {"rpe_rotation_rmse", "RPE rmse [deg]", 4, false},
    {"rpe_percent", "RPE [%]", 3, false},
    {"rpe_deg_per_m", "RPE [deg/m]", 5, false},
    {"drift_percent", "drift [%]", 3, false},
    {"longest_gap", "longest gap [s]", 2, false},
    {"initialised_after", "initialised [s]", 2, false},
    {"frame_median", "frame median [ms]", 1, false},
    {"frame_p95", "frame 95% [ms]", 1, false},
    {"dropped", "dropped", 0, false},
    {"mapping_lag", "lag [frames]", 0, false},
    {"keyframes", "keyframes", 0, false},
    {"lost_events", "lost", 0, false},
    {"realtime_factor", "x real time", 2, true},
    {"peak_mb", "peak [MB]", 0, false},
};
constexpr std::string_view kStage = "stage.";

void take(const Json& json, const std::string& pointer, const std::string& key, Figures& figures,
          double factor = 1) {
  const Pointer place(pointer);
  if (!json.is_object() || !json.contains(place)) return;
  const Json& value = json.at(place);
  if (value.is_number()) figures[key] = factor * value.get<double>();
}

void take_errors(const Json& trajectory, const std::string& headline, Figures& figures) {
  const std::string at = "/" + headline;
  take(trajectory, at + "/ate_m/rmse", "ate_rmse", figures);
  take(trajectory, at + "/ate_m/std", "ate_std", figures);
  take(trajectory, at + "/rpe_frame_m/rmse", "rpe_rmse", figures, 1000);
  take(trajectory, at + "/rpe_frame_m/std", "rpe_std", figures, 1000);
  take(trajectory, at + "/rpe_frame_deg/rmse", "rpe_rotation_rmse", figures);
  take(trajectory, at + "/rpe_distance/translation_percent", "rpe_percent", figures);
  take(trajectory, at + "/rpe_distance/rotation_deg_per_m", "rpe_deg_per_m", figures);
  take(trajectory, at + "/drift/percent", "drift_percent", figures);
  take(trajectory, "/longest_gap_s", "longest_gap", figures);
}

// Of signs only the size counts: the median of +1% and -1% is not 0.
void take_size(const Json& json, const std::string& pointer, const std::string& key,
               Figures& figures) {
  take(json, pointer, key, figures);
  if (const auto found = figures.find(key); found != figures.end()) {
    found->second = std::abs(found->second);
  }
}

void take_largest_drift(const Json& live, Figures& figures) {
  if (!live.contains("dead_reckoning")) return;
  for (const Json& gap : live["dead_reckoning"]) {
    Figures one;
    take(gap, "/drift_m", "gap_drift", one);
    if (!one.empty()) figures["gap_drift"] = std::max(figures["gap_drift"], one["gap_drift"]);
  }
}

void take_live(const Json& evaluation, Figures& figures) {
  if (!evaluation.is_object() || !evaluation.contains("live")) return;
  const Json& live = evaluation["live"];
  take(live, "/late_ate_m/rmse", "late_causal_ate", figures);
  take_size(live, "/early_scale/percent", "early_scale_error", figures);
  take_size(live, "/final_scale/percent", "final_scale_error", figures);
  take(live, "/causal_step/m", "causal_step", figures, 1000);
  take(live, "/odometry_step/m", "odometry_step", figures, 1000);
  take(live, "/coverage", "coverage_after", figures, 100);
  take(live, "/final_gaps/inside_m/rmse", "gap_ate", figures);
  take_largest_drift(live, figures);
}

void take_stages(const Json& summary, Figures& figures) {
  if (!summary.is_object() || !summary.contains("stages")) return;
  for (const auto& [stage, times] : summary["stages"].items()) {
    take(times, "/median", fmt::format("{}{}.median", kStage, stage), figures);
    take(times, "/p95", fmt::format("{}{}.p95", kStage, stage), figures);
  }
}

FigureSummary summarize_figure(const std::string& key, std::vector<double> values) {
  const auto kind = std::find_if(std::begin(kKinds), std::end(kKinds),
                                 [&](const FigureKind& k) { return k.key == key; });
  const ErrorStatistics statistics = statistics_of(std::move(values));
  const bool more_is_better = kind != std::end(kKinds) && kind->more_is_better;
  return {statistics.count, statistics.median, more_is_better ? statistics.min : statistics.max};
}

BenchmarkCell summarize_cell(const CellName& name, const std::vector<BenchmarkRun>& runs) {
  BenchmarkCell cell{name, 0, 0, {}};
  std::map<std::string, std::vector<double>> values;
  for (const BenchmarkRun& run : runs) {
    if (run.cell != name) continue;
    ++cell.runs;
    cell.failed += !run.failure.empty();
    for (const auto& [key, value] : run.figures) values[key].push_back(value);
  }
  for (auto& [key, list] : values) cell.figures[key] = summarize_figure(key, std::move(list));
  return cell;
}

std::string row_label(const CellName& name) { return name.sequence + " " + name.mode; }

template <class Field>
std::vector<std::string> distinct(const std::vector<BenchmarkCell>& cells, const Field& field) {
  std::vector<std::string> values;
  for (const BenchmarkCell& cell : cells) {
    const std::string value = field(cell.name);
    if (std::find(values.begin(), values.end(), value) == values.end()) values.push_back(value);
  }
  return values;
}

const BenchmarkCell* find_cell(const std::vector<BenchmarkCell>& cells, const std::string& row,
                               const std::string& configuration) {
  for (const BenchmarkCell& cell : cells) {
    if (row_label(cell.name) == row && cell.name.configuration == configuration) return &cell;
  }
  return nullptr;
}

// The figures that any cell has.
std::vector<const FigureKind*> present_kinds(const std::vector<BenchmarkCell>& cells) {
  std::vector<const FigureKind*> kinds;
  for (const FigureKind& kind : kKinds) {
    const auto has = [&](const BenchmarkCell& cell) { return cell.figures.contains(kind.key); };
    if (std::any_of(cells.begin(), cells.end(), has)) kinds.push_back(&kind);
  }
  return kinds;
}

// The names of stages that any cell has.
std::set<std::string> present_stages(const std::vector<BenchmarkCell>& cells) {
  constexpr std::string_view kEnd = ".median";
  std::set<std::string> stages;
  for (const BenchmarkCell& cell : cells) {
    for (const auto& [key, summary] : cell.figures) {
      if (!key.starts_with(kStage) || !key.ends_with(kEnd)) continue;
      stages.insert(key.substr(kStage.size(), key.size() - kStage.size() - kEnd.size()));
    }
  }
  return stages;
}

TableRows heading(const std::string& first, const std::vector<BenchmarkCell>& cells) {
  TableRows rows = {{first}};
  for (const BenchmarkCell& cell : cells) rows[0].push_back(cell.name.configuration);
  return rows;
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c == '\n' ? ' ' : c);
  return quoted + "\"";
}

}  // namespace

std::span<const FigureKind> figure_kinds() { return kKinds; }

const FigureKind& figure_kind(const std::string& key) {
  for (const FigureKind& kind : kKinds) {
    if (kind.key == key) return kind;
  }
  throw std::logic_error("no figure is called " + key);
}

Figures figures_of_trajectory(const Json& evaluation, const std::string& trajectory) {
  Figures figures;
  const Pointer place = Pointer("/trajectories") / trajectory;
  if (!evaluation.is_object() || !evaluation.contains(place)) return figures;
  const Json& judged = evaluation.at(place);
  take_errors(judged, evaluation.value("headline", "se3"), figures);
  take(judged, "/coverage", "coverage", figures, 100);
  return figures;
}

Figures figures_of_run(const Json& summary, const Json& evaluation) {
  Figures figures = figures_of_trajectory(evaluation, "final");
  const Figures causal = figures_of_trajectory(evaluation, "causal");
  if (causal.contains("ate_rmse")) figures["causal_ate_rmse"] = causal.at("ate_rmse");
  take_live(evaluation, figures);
  take(evaluation, "/initialised_after_s", "initialised_after", figures);
  take(summary, "/coverage", "coverage", figures, 100);
  take(summary, "/frame_ms/median", "frame_median", figures);
  take(summary, "/frame_ms/p95", "frame_p95", figures);
  take(summary, "/dropped_frames", "dropped", figures);
  take(summary, "/mapping_lag_frames", "mapping_lag", figures);
  take(summary, "/keyframes", "keyframes", figures);
  take(summary, "/lost_events", "lost_events", figures);
  take(summary, "/realtime_factor", "realtime_factor", figures);
  take(summary, "/peak_rss_mb", "peak_mb", figures);
  take_stages(summary, figures);
  return figures;
}

std::vector<BenchmarkCell> summarize(const std::vector<BenchmarkRun>& runs) {
  std::vector<BenchmarkCell> cells;
  std::set<CellName> done;
  for (const BenchmarkRun& run : runs) {
    if (done.insert(run.cell).second) cells.push_back(summarize_cell(run.cell, runs));
  }
  return cells;
}

std::string format_summary(const BenchmarkCell& cell, const FigureKind& kind) {
  const auto found = cell.figures.find(kind.key);
  if (found == cell.figures.end()) return "-";
  const std::string median = fmt::format("{:.{}f}", found->second.median, kind.decimals);
  const std::string worst = fmt::format("{:.{}f}", found->second.worst, kind.decimals);
  return median == worst ? median : fmt::format("{} ({})", median, worst);
}

TableRows side_by_side(const std::vector<BenchmarkCell>& cells) {
  const auto columns = distinct(cells, [](const CellName& n) { return n.configuration; });
  TableRows rows = {{"ATE rmse [m]"}};
  rows[0].insert(rows[0].end(), columns.begin(), columns.end());
  for (const std::string& label : distinct(cells, row_label)) {
    rows.push_back({label});
    for (const std::string& column : columns) {
      const BenchmarkCell* cell = find_cell(cells, label, column);
      rows.back().push_back(cell ? format_summary(*cell, figure_kind("ate_rmse")) : "");
    }
  }
  return rows;
}

TableRows figure_rows(const std::vector<BenchmarkCell>& cells_of_one) {
  TableRows rows = heading(row_label(cells_of_one.front().name), cells_of_one);
  rows.push_back({"runs (failed)"});
  for (const BenchmarkCell& cell : cells_of_one) {
    rows[1].push_back(fmt::format("{} ({})", cell.runs, cell.failed));
  }
  for (const FigureKind* kind : present_kinds(cells_of_one)) {
    rows.push_back({kind->label});
    for (const BenchmarkCell& cell : cells_of_one) {
      rows.back().push_back(format_summary(cell, *kind));
    }
  }
  return rows;
}

TableRows stage_rows(const std::vector<BenchmarkCell>& cells_of_one) {
  TableRows rows = heading("stage, median and 95% [ms]", cells_of_one);
  for (const std::string& stage : present_stages(cells_of_one)) {
    rows.push_back({stage});
    for (const BenchmarkCell& cell : cells_of_one) {
      const auto median = cell.figures.find(fmt::format("{}{}.median", kStage, stage));
      const auto p95 = cell.figures.find(fmt::format("{}{}.p95", kStage, stage));
      rows.back().push_back(
          median == cell.figures.end() || p95 == cell.figures.end()
              ? "-"
              : fmt::format("{:.2f}, {:.2f}", median->second.median, p95->second.median));
    }
  }
  return rows;
}

std::vector<std::vector<BenchmarkCell>> by_sequence(const std::vector<BenchmarkCell>& cells) {
  std::vector<std::vector<BenchmarkCell>> groups;
  for (const std::string& label : distinct(cells, row_label)) {
    groups.emplace_back();
    for (const BenchmarkCell& cell : cells) {
      if (row_label(cell.name) == label) groups.back().push_back(cell);
    }
  }
  return groups;
}

std::string format_benchmark(const std::vector<BenchmarkCell>& cells) {
  std::string text = "Median over the runs of a cell, the worst in brackets.\n\n";
  text += format_rows(side_by_side(cells));
  for (const auto& group : by_sequence(cells)) {
    text += "\n" + format_rows(figure_rows(group)) + "\n";
    text += format_rows(stage_rows(group));
  }
  return text;
}

std::string benchmark_csv(const std::vector<BenchmarkRun>& runs) {
  std::set<std::string> stages;
  for (const BenchmarkRun& run : runs) {
    for (const auto& [key, value] : run.figures) {
      if (key.starts_with(kStage)) stages.insert(key);
    }
  }
  std::vector<std::string> columns;
  for (const FigureKind& kind : kKinds) columns.emplace_back(kind.key);
  columns.insert(columns.end(), stages.begin(), stages.end());
  std::string text = "sequence,mode,configuration,seed,repetition,failure";
  for (const std::string& column : columns) text += "," + column;
  text += '\n';
  for (const BenchmarkRun& run : runs) {
    text += fmt::format("{},{},{},{},{},{}", run.cell.sequence, run.cell.mode,
                        run.cell.configuration, run.seed, run.repetition, csv_field(run.failure));
    for (const std::string& column : columns) {
      const auto found = run.figures.find(column);
      text += found == run.figures.end() ? "," : fmt::format(",{:.9g}", found->second);
    }
    text += '\n';
  }
  return text;
}

nlohmann::ordered_json benchmark_json(const std::vector<BenchmarkRun>& runs) {
  nlohmann::ordered_json json = {{"cells", Json::array()}, {"runs", Json::array()}};
  const auto describe = [](const CellName& name) {
    return nlohmann::ordered_json{
        {"sequence", name.sequence}, {"mode", name.mode}, {"configuration", name.configuration}};
  };
  for (const BenchmarkCell& cell : summarize(runs)) {
    auto entry = describe(cell.name);
    entry["runs"] = cell.runs;
    entry["failed"] = cell.failed;
    for (const auto& [key, s] : cell.figures) {
      entry["figures"][key] = {{"count", s.count}, {"median", s.median}, {"worst", s.worst}};
    }
    json["cells"].push_back(std::move(entry));
  }
  for (const BenchmarkRun& run : runs) {
    auto entry = describe(run.cell);
    entry.update({{"seed", run.seed},
                  {"repetition", run.repetition},
                  {"folder", run.folder},
                  {"failure", run.failure},
                  {"figures", run.figures}});
    json["runs"].push_back(std::move(entry));
  }
  return json;
}

}  // namespace rover
