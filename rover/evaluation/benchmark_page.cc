#include "rover/evaluation/benchmark_page.h"

#include <algorithm>

#include <fmt/format.h>

#include "rover/datasets/text_rows.h"
#include "rover/evaluation/html.h"
#include "rover/evaluation/svg.h"
#include "rover/evaluation/trajectory_svg.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

// "trajectory_reference.txt" and "trajectory_aligned.txt" of a run, as `rover evaluate` leaves
// them.
std::string small_drawing(const fs::path& folder) {
  const fs::path aligned = folder / "trajectory_aligned.txt";
  const fs::path reference = folder / "trajectory_reference.txt";
  if (!fs::exists(aligned) || !fs::exists(reference)) return "";
  return draw_small({"", read_tum_trajectory(reference)}, {{"", read_tum_trajectory(aligned)}});
}

std::string link_to(const BenchmarkRun& run, const fs::path& folder) {
  const std::string name = fmt::format("seed {}, run {}", run.seed, run.repetition);
  if (!run.failure.empty()) {
    return fmt::format("<div class=\"failed\">{}: {}</div>\n", name, escape_xml(run.failure));
  }
  if (!fs::exists(folder / run.folder / "report.html")) return "";
  return fmt::format("<a href=\"{}/report.html\">{}</a><br>\n", escape_xml(run.folder), name);
}

std::string configuration_figure(const BenchmarkCell& cell, const fs::path& folder,
                                 const std::vector<BenchmarkRun>& runs) {
  std::string drawing, links;
  for (const BenchmarkRun& run : runs) {
    if (run.cell != cell.name || run.folder.empty()) continue;
    if (drawing.empty() && run.failure.empty()) drawing = small_drawing(folder / run.folder);
    links += link_to(run, folder);
  }
  if (drawing.empty() && links.empty()) return "";
  return fmt::format("<figure>{}<figcaption><b>{}</b><br>\n{}</figcaption></figure>\n", drawing,
                     escape_xml(cell.name.configuration), links);
}

std::string group_section(const std::vector<BenchmarkCell>& group, const fs::path& folder,
                          const std::vector<BenchmarkRun>& runs) {
  std::string html = html_table(figure_rows(group));
  std::string drawings;
  for (const BenchmarkCell& cell : group) drawings += configuration_figure(cell, folder, runs);
  if (!drawings.empty()) html += "<p></p><div class=\"grid\">\n" + drawings + "</div>\n";
  html += html_details("Times of the stages", html_table(stage_rows(group)));
  const CellName& name = group.front().name;
  return html_section(
      name.sequence + ", " + name.mode,
      "Median over the runs, the worst in brackets. Drawings: the first run's final "
      "trajectory (blue) over the ground truth (gray).",
      html);
}

}  // namespace

std::string benchmark_page(const std::string& title, const fs::path& folder,
                           const std::vector<BenchmarkRun>& runs) {
  const auto cells = summarize(runs);
  const auto failed = std::count_if(runs.begin(), runs.end(),
                                    [](const BenchmarkRun& run) { return !run.failure.empty(); });
  std::string body =
      fmt::format("<h1>{}</h1>\n<p class=\"sub\">{} runs in {} cells, {} failed</p>\n",
                  escape_xml(title), runs.size(), cells.size(), failed);
  body +=
      html_section("Side by side",
                   "ATE of the final trajectory: SE(3) where the scale is known, Sim(3) for one "
                   "camera. Median over the runs, the worst in brackets.",
                   html_table(side_by_side(cells)));
  for (const auto& group : by_sequence(cells)) body += group_section(group, folder, runs);
  return html_page("Rover benchmark: " + title, body);
}

}  // namespace rover
