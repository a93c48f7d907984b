#include "rover/evaluation/inertial_report.h"

#include <fmt/format.h>

#include "rover/base/error.h"
#include "rover/datasets/text_rows.h"
#include "rover/evaluation/html.h"
#include "rover/evaluation/svg.h"

namespace rover {
namespace {

constexpr const char* kAxes[] = {"x", "y", "z"};
constexpr const char* kBound = "#c9c9c9";

template <class Value>
ChartSeries series_of(const RunFolder& run, const std::string& name, const char* color,
                      const Value& value) {
  ChartSeries series{name, color, {}, {}};
  for (const StateLine& state : run.motion) {
    series.x.push_back(seconds_between(run.offered.first, state.time));
    series.y.push_back(value(state));
  }
  return series;
}

// Three neighbouring values of a state, from `first` on, between their bounds if those are asked
// for.
std::string chart_of_three(const RunFolder& run, Chart chart, const std::string& label,
                           std::size_t first, bool bounds) {
  chart.y_label = label;
  chart.height = 120;
  chart.from_zero = false;
  for (std::size_t axis = 0; bounds && axis < 3; ++axis) {
    for (const double sigmas : {-3.0, 3.0}) {
      const std::string name = axis == 0 && sigmas < 0 ? "3 sigma" : "";
      chart.series.push_back(series_of(run, name, kBound, [&](const StateLine& state) {
        return state.values[first + axis] + sigmas * state.sigmas[first + axis];
      }));
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    chart.series.push_back(
        series_of(run, kAxes[axis], series_color(axis + 2),
                  [&](const StateLine& state) { return state.values[first + axis]; }));
  }
  return draw_chart(chart);
}

// initialised, refined, undone; as summary.json has them.
std::string events_table(const RunFolder& run) {
  const nlohmann::ordered_json::json_pointer place("/inertial/events");
  std::vector<std::vector<std::string>> rows = {{"time [s]", "event", "scale known to [%]"}};
  if (!run.summary.contains(place)) return "";
  for (const auto& event : run.summary.at(place)) {
    const Timestamp time = parse_seconds_field(event.value("time", ""));
    rows.push_back({fmt::format("{:.2f}", seconds_between(run.offered.first, time)),
                    event.value("event", ""),
                    fmt::format("{:.2f}", 100 * event.value("scale_sigma", 0.0))});
  }
  return rows.size() > 1 ? html_table(rows) : "";
}

}  // namespace

std::string inertial_section(const RunFolder& run, const Chart& empty) {
  if (run.motion.empty()) return "";
  return html_section("Inertial state",
                      "As estimated when the frame arrived, from the time when scale and gravity "
                      "were known. Gray: three standard deviations to both sides.",
                      events_table(run) + chart_of_three(run, empty, "velocity [m/s]", 0, false) +
                          chart_of_three(run, empty, "gyroscope bias [rad/s]", 3, true) +
                          chart_of_three(run, empty, "accelerometer bias [m/s2]", 6, true));
}

}  // namespace rover
