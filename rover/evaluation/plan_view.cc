#include "rover/evaluation/plan_view.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "rover/evaluation/svg.h"

namespace rover {
namespace {

constexpr Timestamp kBreak = kNanosecondsPerSecond;
constexpr double kFinest = 0.4;  // px between points of a line
constexpr double kAxes = 46;     // px below a view, for its axis

std::array<int, 3> axes_by_extent(const Eigen::AlignedBox3d& bounds) {
  std::array<int, 3> axes = {0, 1, 2};
  const Eigen::Vector3d sizes = bounds.sizes();
  std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) { return sizes[a] > sizes[b]; });
  return axes;
}

PlanView make_view(const Eigen::AlignedBox3d& bounds, int right, int up, double pixels_per_metre,
                   const PlanLayout& layout, double top) {
  PlanView view{right,
                up,
                {bounds.min()[right], bounds.min()[up]},
                {bounds.max()[right], bounds.max()[up]},
                pixels_per_metre,
                0,
                top};
  const double missing = layout.min_height / pixels_per_metre - (view.high.y() - view.low.y());
  if (missing > 0) {
    view.low.y() -= 0.5 * missing;
    view.high.y() += 0.5 * missing;
  }
  view.left = layout.margin + 0.5 * (layout.width - 2 * layout.margin - view.width());
  return view;
}

}  // namespace

Eigen::AlignedBox3d box_around(const Eigen::AlignedBox3d& positions) {
  Eigen::AlignedBox3d box = positions;
  if (box.isEmpty()) box.extend(Eigen::Vector3d::Zero().eval());
  const double air = std::max(1e-3, 0.04 * box.sizes().maxCoeff());
  return {box.min().array() - air, box.max().array() + air};
}

PlanViews lay_out(const Eigen::AlignedBox3d& box, const PlanLayout& layout) {
  const auto [first, second, third] = axes_by_extent(box);
  const double scale = std::min((layout.width - 2 * layout.margin) / box.sizes()[first],
                                layout.max_height / box.sizes()[second]);
  PlanViews views;
  views.above = make_view(box, first, second, scale, layout, layout.legend + layout.top);
  views.side =
      make_view(box, first, third, scale, layout, views.above.bottom() + kAxes + layout.top);
  views.height = views.side.bottom() + kAxes;
  return views;
}

std::string draw_grid(const PlanView& view) {
  constexpr const char* kThin = "stroke=\"#e8e8e8\"";
  const double step =
      tick_step(std::max(view.high.x() - view.low.x(), view.high.y() - view.low.y()),
                std::clamp(static_cast<int>(std::max(view.width(), view.height()) / 70), 3, 10));
  std::string svg;
  for (const double x : ticks_within(view.low.x(), view.high.x(), step)) {
    svg += svg_line(view.page_right(x), view.top, view.page_right(x), view.bottom(), kThin);
    svg += svg_text(view.page_right(x), view.bottom() + 16, "middle", tick_text(x, step));
  }
  for (const double y : ticks_within(view.low.y(), view.high.y(), step)) {
    svg += svg_line(view.left, view.page_up(y), view.left + view.width(), view.page_up(y), kThin);
    svg += svg_text(view.left - 8, view.page_up(y) + 4, "end", tick_text(y, step));
  }
  return svg;
}

std::string draw_frame(const PlanView& view, const std::string& title) {
  constexpr const char* kAxisNames = "xyz";
  std::string svg = svg_rectangle(view.left, view.top, view.width(), view.height(),
                                  "fill=\"none\" stroke=\"#777\"");
  svg += svg_text(view.left + 0.5 * view.width(), view.bottom() + 34, "middle",
                  fmt::format("{} [m]", kAxisNames[view.right]));
  svg += fmt::format(
      "<text transform=\"translate({:.1f} {:.1f}) rotate(-90)\" text-anchor=\"middle\">{} "
      "[m]</text>\n",
      view.left - 46, view.top + 0.5 * view.height(), kAxisNames[view.up]);
  return svg + svg_text(view.left, view.top - 8, "start", title, "font-weight=\"600\"");
}

std::string draw_path(const PlanView& view, const Trajectory& trajectory, const char* color,
                      double width) {
  if (trajectory.empty()) return "";
  std::string commands;
  Eigen::Vector2d last = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const bool begins = i == 0 || trajectory[i].time - trajectory[i - 1].time > kBreak;
    const bool ends =
        i + 1 == trajectory.size() || trajectory[i + 1].time - trajectory[i].time > kBreak;
    const Eigen::Vector3d& p = trajectory[i].pose.translation;
    const Eigen::Vector2d here(view.page_x(p), view.page_y(p));
    if (!begins && !ends && (here - last).norm() < kFinest) continue;
    commands += fmt::format("{}{:.1f} {:.1f}", begins ? 'M' : 'L', here.x(), here.y());
    last = here;
  }
  return fmt::format(
      "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\" "
      "stroke-linecap=\"round\"/>\n",
      commands, color, width);
}

std::string draw_start(const PlanView& view, const Trajectory& trajectory, const char* color) {
  if (trajectory.empty()) return "";
  const Eigen::Vector3d& p = trajectory.front().pose.translation;
  return fmt::format(
      "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4.5\" fill=\"#fff\" stroke=\"{}\" "
      "stroke-width=\"1.8\"/>\n",
      view.page_x(p), view.page_y(p), color);
}

}  // namespace rover
