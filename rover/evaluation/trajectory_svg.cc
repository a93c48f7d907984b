#include "rover/evaluation/trajectory_svg.h"

#include <fmt/format.h>

#include "rover/evaluation/plan_view.h"
#include "rover/evaluation/svg.h"

namespace rover {
namespace {

constexpr double kLegendLine = 22;

Eigen::AlignedBox3d bounds_of(const DrawnTrajectory& reference,
                              const std::vector<DrawnTrajectory>& estimates) {
  Eigen::AlignedBox3d box;
  const auto add = [&](const DrawnTrajectory& drawn) {
    for (const StampedPose& stamped : drawn.trajectory) box.extend(stamped.pose.translation);
  };
  add(reference);
  for (const DrawnTrajectory& estimate : estimates) add(estimate);
  return box_around(box);
}

std::string draw_view(const PlanView& view, const std::string& title,
                      const DrawnTrajectory& reference,
                      const std::vector<DrawnTrajectory>& estimates) {
  std::string svg = draw_grid(view);
  svg += draw_path(view, reference.trajectory, kReferenceColor, 3.6);
  // The first estimate is the one that matters: drawn last, on top.
  for (std::size_t i = estimates.size(); i-- > 0;) {
    svg += draw_path(view, estimates[i].trajectory, series_color(i), i == 0 ? 1.6 : 1.2);
  }
  svg += draw_start(view, reference.trajectory, kReferenceColor);
  if (!estimates.empty()) svg += draw_start(view, estimates[0].trajectory, series_color(0));
  return svg + draw_frame(view, title);
}

std::string legend_entry(double x, double y, const char* color, double width,
                         const std::string& name) {
  return svg_line(x, y, x + 34, y, fmt::format("stroke=\"{}\" stroke-width=\"{}\"", color, width)) +
         svg_text(x + 44, y + 4, "start", name);
}

std::string draw_legend(double x, const DrawnTrajectory& reference,
                        const std::vector<DrawnTrajectory>& estimates) {
  double y = 16;
  std::string svg;
  if (!reference.trajectory.empty()) {
    svg += legend_entry(x, y, kReferenceColor, 3.6, reference.name + " (circle: begin)");
    y += kLegendLine;
  }
  for (std::size_t i = 0; i < estimates.size(); ++i, y += kLegendLine) {
    svg += legend_entry(x, y, series_color(i), 2, estimates[i].name);
  }
  return svg;
}

}  // namespace

std::string draw_trajectories(const DrawnTrajectory& reference,
                              const std::vector<DrawnTrajectory>& estimates) {
  PlanLayout layout;
  layout.legend = kLegendLine * static_cast<double>(estimates.size() + 1) + 8;
  const PlanViews views = lay_out(bounds_of(reference, estimates), layout);
  std::string svg = draw_legend(layout.margin, reference, estimates);
  svg += draw_view(views.above, "along the axis of least extent", reference, estimates);
  svg += draw_view(views.side, "from the side", reference, estimates);
  return svg_drawing(layout.width, views.height, svg);
}

std::string draw_small(const DrawnTrajectory& reference,
                       const std::vector<DrawnTrajectory>& estimates) {
  PlanLayout layout;
  layout.width = 300;
  layout.margin = 4;
  layout.max_height = 220;
  layout.min_height = 40;
  layout.top = 4;
  const PlanView view = lay_out(bounds_of(reference, estimates), layout).above;
  std::string svg = draw_path(view, reference.trajectory, kReferenceColor, 3);
  for (std::size_t i = estimates.size(); i-- > 0;) {
    svg += draw_path(view, estimates[i].trajectory, series_color(i), 1.3);
  }
  return svg_drawing(layout.width, view.bottom() + 4, svg);
}

}  // namespace rover
