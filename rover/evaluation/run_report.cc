#include "rover/evaluation/run_report.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "rover/base/error.h"
#include "rover/datasets/text_rows.h"
#include "rover/evaluation/base64.h"
#include "rover/evaluation/chart.h"
#include "rover/evaluation/html.h"
#include "rover/evaluation/inertial_report.h"
#include "rover/evaluation/point_cloud.h"
#include "rover/evaluation/svg.h"
#include "rover/evaluation/trajectory_svg.h"
#include "rover/evaluation/verdict.h"
#include "rover/geometry/so3.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

double seconds_of(const RunReport& report, Timestamp time) {
  return seconds_between(report.run.offered.first, time);
}

const std::optional<AlignedErrors>& headline_errors(const RunReport& report, std::size_t index) {
  return errors_under(report.judgements[index], report.options.headline);
}

// The final trajectory in the frame of the reference, if that is known.
Sim3 reference_from_world(const RunReport& report) {
  if (report.judgements.empty()) return Sim3();
  const auto& errors = headline_errors(report, 0);
  return errors ? errors->reference_from_estimate : Sim3();
}

// Where frames have no pose, and keyframes.
Chart chart_of_run(const RunReport& report) {
  Chart chart;
  chart.x_high = seconds_of(report, report.run.offered.last);
  const auto& frames = report.run.frames;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].state != "lost" && frames[i].state != "waiting") continue;
    const double begin = seconds_of(report, frames[i].time);
    const double end = seconds_of(report, frames[std::min(i + 1, frames.size() - 1)].time);
    if (!chart.shaded.empty() && begin <= chart.shaded.back().second) {
      chart.shaded.back().second = end;
    } else {
      chart.shaded.emplace_back(begin, end);
    }
  }
  for (const StampedPose& keyframe : report.run.keyframes) {
    chart.marks.push_back(seconds_of(report, keyframe.time));
  }
  return chart;
}

template <class Value>
ChartSeries series_of_frames(const RunReport& report, const std::string& name, const char* color,
                             const Value& value) {
  ChartSeries series{name, color, {}, {}};
  for (const FrameLine& frame : report.run.frames) {
    series.x.push_back(seconds_of(report, frame.time));
    series.y.push_back(value(frame));
  }
  return series;
}

std::string tiles(const RunReport& report) {
  const RunFolder& run = report.run;
  std::string html;
  if (!report.judgements.empty() && headline_errors(report, 0)) {
    const AlignedErrors& errors = *headline_errors(report, 0);
    html += html_tile(length_words(errors.position.rmse),
                      fmt::format("ATE, {}, final", name_of(report.options.headline)));
    html += html_tile(length_words(errors.relative_translation.rmse), "error from frame to frame");
  }
  html += html_tile(fmt::format("{:.1f}%", 100.0 * static_cast<double>(run.final.size()) /
                                               static_cast<double>(run.offered.frames)),
                    "frames with a pose");
  const auto number = [&](const char* pointer) -> std::optional<double> {
    const nlohmann::ordered_json::json_pointer place(pointer);
    if (!run.summary.contains(place) || !run.summary.at(place).is_number()) return std::nullopt;
    return run.summary.at(place).get<double>();
  };
  if (const auto ms = number("/frame_ms/median")) {
    html += html_tile(fmt::format("{:.1f} ms", *ms), "per frame, median");
  }
  if (const auto factor = number("/realtime_factor")) {
    html += html_tile(fmt::format("{:.2f} x", *factor), "real time, with mapping");
  }
  if (const auto memory = number("/peak_rss_mb")) {
    html += html_tile(fmt::format("{:.0f} MB", *memory), "memory at most");
  }
  return "<div class=\"tiles\">\n" + html + "</div>\n";
}

std::string head(const RunReport& report) {
  const RunFolder& run = report.run;
  std::string html =
      fmt::format("<h1>{}</h1>\n<p class=\"sub\">{}, {} frames in {:.1f} s; poses of {}</p>\n",
                  escape_xml(report.title), escape_xml(run.mode), run.offered.frames,
                  seconds_between(run.offered.first, run.offered.last),
                  run.pose_frame == "body" ? "the body (inertial sensor)" : "camera 0");
  for (const std::string& sentence : verdict(run, report.judgements, report.options)) {
    html += "<p>" + escape_xml(sentence) + "</p>\n";
  }
  return html;
}

std::string figures_section(const RunReport& report) {
  if (report.judgements.empty()) return "";
  return html_section("Figures",
                      "Final: every frame through the finished map. Causal: the pose given when "
                      "the frame arrived. docs/evaluation.md says what each figure means.",
                      html_table(table_rows(report.judgements, report.options)));
}

std::string trajectory_section(const RunReport& report) {
  std::vector<DrawnTrajectory> drawn;
  for (std::size_t i = 0; i < report.judgements.size(); ++i) {
    const auto& errors = headline_errors(report, i);
    if (!errors) continue;  // nothing says where it would lie
    drawn.push_back({report.judgements[i].name,
                     move_world(errors->reference_from_estimate, report.estimates[i])});
  }
  if (report.judgements.empty()) drawn.push_back({"final", report.run.final});
  return html_section("Trajectory",
                      report.judgements.empty() ? "In the frame of the first keyframe."
                                                : "Laid over the ground truth.",
                      draw_trajectories({"ground truth", report.reference}, drawn));
}

// What errors of about this size are drawn in.
struct LengthUnit {
  const char* name;
  double per_metre;
};
LengthUnit unit_for(double metres) {
  return metres < 0.1 ? LengthUnit{"mm", 1000} : LengthUnit{"m", 1};
}

// Pairs of one trajectory in the headline's alignment; none where that is not determined.
std::vector<PosePair> aligned_pairs(const RunReport& report, std::size_t index) {
  const auto& errors = headline_errors(report, index);
  if (!errors) return {};
  return move_estimates(errors->reference_from_estimate, report.judgements[index].pairs);
}

// `value` of each pair over time, broken where there are none for more than a second.
template <class Value>
ChartSeries series_of_pairs(const RunReport& report, const std::vector<PosePair>& aligned,
                            const std::string& name, const char* color, const Value& value) {
  ChartSeries series{name, color, {}, {}};
  for (std::size_t i = 0; i < aligned.size(); ++i) {
    if (i > 0 && seconds_between(aligned[i - 1].time, aligned[i].time) > 1) {
      series.x.push_back(seconds_of(report, aligned[i].time));
      series.y.push_back(kNothing);
    }
    series.x.push_back(seconds_of(report, aligned[i].time));
    series.y.push_back(value(aligned[i]));
  }
  return series;
}

std::string total_errors(const RunReport& report, const LengthUnit& unit) {
  Chart chart = chart_of_run(report);
  chart.y_label = fmt::format("position error [{}]", unit.name);
  for (std::size_t i = 0; i < report.judgements.size(); ++i) {
    chart.series.push_back(series_of_pairs(
        report, aligned_pairs(report, i), report.judgements[i].name, series_color(i),
        [&](const PosePair& pair) {
          return unit.per_metre * (pair.estimate.translation - pair.reference.translation).norm();
        }));
  }
  return draw_chart(chart);
}

std::string errors_per_axis(const RunReport& report, const LengthUnit& unit) {
  constexpr const char* kNames[] = {"x", "y", "z"};
  Chart chart = chart_of_run(report);
  chart.y_label = fmt::format("error per axis [{}]", unit.name);
  chart.from_zero = false;
  chart.height = 140;
  for (int axis = 0; axis < 3; ++axis) {
    chart.series.push_back(series_of_pairs(
        report, aligned_pairs(report, 0), kNames[axis],
        series_color(static_cast<std::size_t>(axis) + 2), [&](const PosePair& pair) {
          return unit.per_metre * (pair.estimate.translation - pair.reference.translation)[axis];
        }));
  }
  return draw_chart(chart);
}

std::string rotation_errors(const RunReport& report) {
  Chart chart = chart_of_run(report);
  chart.y_label = "rotation error [deg]";
  chart.height = 110;
  chart.series = {series_of_pairs(
      report, aligned_pairs(report, 0), "", series_color(0), [](const PosePair& pair) {
        const Eigen::Quaterniond error = pair.reference.rotation.inverse() * pair.estimate.rotation;
        return so3_log(error).norm() * 180 / std::numbers::pi;
      })};
  return draw_chart(chart);
}

std::string error_section(const RunReport& report) {
  if (report.judgements.empty() || !headline_errors(report, 0)) return "";
  const LengthUnit unit = unit_for(headline_errors(report, 0)->position.rmse);
  return html_section(
      "Errors over time",
      "After the alignment of the whole. Shaded: no pose at that time. Red marks: keyframes. Per "
      "axis and rotation: of the final trajectory.",
      total_errors(report, unit) + errors_per_axis(report, unit) + rotation_errors(report));
}

std::string tracking_section(const RunReport& report) {
  Chart chart = chart_of_run(report);
  chart.y_label = "count";
  const auto when_worked_on = [](double FrameLine::*member) {
    return
        [member](const FrameLine& frame) { return frame.frame_ms > 0 ? frame.*member : kNothing; };
  };
  chart.series = {
      series_of_frames(report, "inliers of the pose", series_color(0),
                       when_worked_on(&FrameLine::inliers)),
      series_of_frames(report, "matches with landmarks", series_color(1),
                       when_worked_on(&FrameLine::matches)),
      series_of_frames(report, "features", "#b5b5b5", when_worked_on(&FrameLine::features))};
  return html_section("Tracking",
                      "Shaded: no pose (waiting for a map, or lost). Red marks: keyframes of the "
                      "final map.",
                      draw_chart(chart));
}

std::string time_section(const RunReport& report) {
  Chart chart = chart_of_run(report);
  chart.y_label = "per frame [ms]";
  chart.series = {series_of_frames(report, "", series_color(0), [](const FrameLine& frame) {
    return frame.frame_ms > 0 ? frame.frame_ms : kNothing;
  })};
  const auto& offered = report.run.offered;
  if (offered.frames > 1) {
    chart.levels.emplace_back(1000 * seconds_between(offered.first, offered.last) /
                                  static_cast<double>(offered.frames - 1),
                              "time between frames");
  }
  std::string histograms;
  for (const StageTiming& stage : report.run.stages) {
    histograms += draw_histogram(stage.stage, "ms", stage.times);
  }
  return html_section("Time",
                      "From the decoded image to its pose; without --realtime a keyframe's mapping "
                      "is in it. Below, each stage by itself: blue line: median, orange: 95%.",
                      draw_chart(chart) + "<div class=\"grid\">\n" + histograms + "</div>\n");
}

std::string memory_section(const RunReport& report) {
  const auto known = [](const FrameLine& frame) { return frame.rss_mb > 0; };
  if (std::none_of(report.run.frames.begin(), report.run.frames.end(), known)) return "";
  Chart chart = chart_of_run(report);
  chart.y_label = "memory [MB]";
  chart.height = 110;
  chart.series = {series_of_frames(report, "", series_color(0), [](const FrameLine& frame) {
    return frame.rss_mb > 0 ? frame.rss_mb : kNothing;
  })};
  return html_section("Memory", "Resident memory of the process, sampled every 20 frames.",
                      draw_chart(chart));
}

std::string picture(const RunReport& report, const SamplePicture& sample) {
  const std::string bytes = read_text_file(sample.file);
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  return fmt::format(
      "<figure><img alt=\"frame\" src=\"{}\"><figcaption>{:.2f} s</figcaption></figure>\n",
      data_url("image/jpeg", {data, bytes.size()}), seconds_of(report, sample.time));
}

std::string pictures_section(const RunReport& report) {
  if (report.run.samples.empty()) return "";
  std::string html = "<div class=\"pictures\">\n";
  for (const SamplePicture& sample : report.run.samples) html += picture(report, sample);
  return html_section("Frames",
                      "Some keyframes. Green: features that belong to a landmark; gray: others.",
                      html + "</div>\n");
}

std::string map_section(const RunReport& report) {
  if (!fs::exists(report.map)) return "";
  const Sim3 move = reference_from_world(report);
  std::vector<Eigen::Vector3d> points, places;
  constexpr std::array<std::uint8_t, 3> kKeyframe = {255, 0, 0};
  for (const ColoredPoint& point : read_point_cloud(report.map)) {
    (point.color == kKeyframe ? places : points).push_back(move * point.position);
  }
  if (points.empty()) return "";
  return html_section(
      "Map",
      fmt::format("{} landmarks, {} keyframes (red). Landmarks far off are left out.",
                  points.size(), places.size()),
      draw_map(points, places));
}

std::string text_of(const nlohmann::ordered_json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

std::string configuration_section(const RunReport& report) {
  std::vector<std::vector<std::string>> facts = {{"what", "value"}},
                                        settings = {{"setting", "value"}};
  for (const auto& [key, value] : report.run.summary.items()) {
    if (value.is_primitive() || value.is_array()) facts.push_back({key, text_of(value)});
  }
  if (report.run.summary.contains("config")) {
    for (const auto& [key, value] : report.run.summary["config"].items()) {
      settings.push_back({key, text_of(value)});
    }
  }
  return html_section("Configuration and versions", "From summary.json of the run.",
                      html_details("What the run says of itself", html_table(facts)) +
                          html_details("All settings", html_table(settings)));
}

}  // namespace

std::string run_report_html(const RunReport& report) {
  std::string body = head(report) + tiles(report);
  body += figures_section(report) + trajectory_section(report) + error_section(report);
  body += inertial_section(report.run, chart_of_run(report));
  body += tracking_section(report) + time_section(report) + memory_section(report);
  body += pictures_section(report) + map_section(report) + configuration_section(report);
  return html_page("Rover: " + report.title, body);
}

}  // namespace rover
