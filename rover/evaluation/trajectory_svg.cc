#include "rover/evaluation/trajectory_svg.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <Eigen/Geometry>

namespace rover {
namespace {

constexpr double kWidth = 900;      // px, of the drawing
constexpr double kMargin = 64;      // px, around each view, for its axes
constexpr double kMaxHeight = 640;  // px, of the inside of one view
constexpr double kMinHeight = 90;
constexpr double kLegendLine = 22;
constexpr Timestamp kBreak = kNanosecondsPerSecond;
constexpr const char* kReferenceColor = "#9a9a9a";
constexpr std::array<const char*, 6> kColors = {"#1f6fb4", "#d9601a", "#2a8f4e",
                                                "#8a4fb0", "#b8860b", "#c23b5a"};

const char* color_of(std::size_t estimate) { return kColors[estimate % kColors.size()]; }

// Names come from the command line and go into XML.
std::string escape(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '&':
        escaped += "&amp;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

// A length of 1, 2 or 5 times a power of ten, so that a view has five to ten grid lines.
double grid_step(double extent) {
  const double raw = std::max(extent, 1e-9) / 10;
  const double power = std::pow(10, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10 * power;
}

// One view: which axes of the world go right and up, what part of them is seen and where on the
// page it lies.
struct View {
  int right = 0;
  int up = 1;
  Eigen::Vector2d low, high;  // metres
  double pixels_per_metre = 1;
  double top = 0;  // px, of the inside

  double width() const { return (high.x() - low.x()) * pixels_per_metre; }
  double height() const { return (high.y() - low.y()) * pixels_per_metre; }
  double bottom() const { return top + height(); }
  double left() const { return kMargin + 0.5 * (kWidth - 2 * kMargin - width()); }
  double page_x(double metres) const { return left() + (metres - low.x()) * pixels_per_metre; }
  double page_y(double metres) const { return bottom() - (metres - low.y()) * pixels_per_metre; }
};

Eigen::AlignedBox3d bounds_of(const DrawnTrajectory& reference,
                              const std::vector<DrawnTrajectory>& estimates) {
  Eigen::AlignedBox3d box;
  const auto add = [&](const DrawnTrajectory& drawn) {
    for (const StampedPose& stamped : drawn.trajectory) box.extend(stamped.pose.translation);
  };
  add(reference);
  for (const DrawnTrajectory& estimate : estimates) add(estimate);
  if (box.isEmpty()) box.extend(Eigen::Vector3d::Zero().eval());
  // Some air, and no view without extent.
  const double air = std::max(1e-3, 0.04 * box.sizes().maxCoeff());
  return {box.min().array() - air, box.max().array() + air};
}

std::array<int, 3> axes_by_extent(const Eigen::AlignedBox3d& bounds) {
  std::array<int, 3> axes = {0, 1, 2};
  const Eigen::Vector3d sizes = bounds.sizes();
  std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) { return sizes[a] > sizes[b]; });
  return axes;
}

View make_view(const Eigen::AlignedBox3d& bounds, int right, int up, double pixels_per_metre,
               double top) {
  View view{right,
            up,
            {bounds.min()[right], bounds.min()[up]},
            {bounds.max()[right], bounds.max()[up]},
            pixels_per_metre,
            top};
  const double missing = kMinHeight / pixels_per_metre - (view.high.y() - view.low.y());
  if (missing > 0) {
    view.low.y() -= 0.5 * missing;
    view.high.y() += 0.5 * missing;
  }
  return view;
}

std::string line(double x1, double y1, double x2, double y2, const char* style) {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>\n", x1, y1,
                     x2, y2, style);
}

std::string label(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor,
                     text);
}

std::string tick_text(double value, double step) {
  const int decimals = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
  return fmt::format("{:.{}f}", std::abs(value) < 0.5 * step ? 0.0 : value, decimals);
}

std::string draw_grid(const View& view) {
  constexpr const char* kThin = "stroke=\"#e4e4e4\"";
  const double step =
      grid_step(std::max(view.high.x() - view.low.x(), view.high.y() - view.low.y()));
  std::string svg;
  for (double x = std::ceil(view.low.x() / step) * step; x <= view.high.x(); x += step) {
    svg += line(view.page_x(x), view.top, view.page_x(x), view.bottom(), kThin);
    svg += label(view.page_x(x), view.bottom() + 18, "middle", tick_text(x, step));
  }
  for (double y = std::ceil(view.low.y() / step) * step; y <= view.high.y(); y += step) {
    svg += line(view.left(), view.page_y(y), view.left() + view.width(), view.page_y(y), kThin);
    svg += label(view.left() - 8, view.page_y(y) + 4, "end", tick_text(y, step));
  }
  return svg;
}

std::string draw_frame(const View& view, const std::string& title) {
  constexpr const char* kAxes = "xyz";
  std::string svg = fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" "
      "stroke=\"#555\"/>\n",
      view.left(), view.top, view.width(), view.height());
  svg += label(view.left() + 0.5 * view.width(), view.bottom() + 38, "middle",
               fmt::format("{} [m]", kAxes[view.right]));
  svg += fmt::format(
      "<text transform=\"translate({:.1f} {:.1f}) rotate(-90)\" "
      "text-anchor=\"middle\">{} [m]</text>\n",
      view.left() - 46, view.top + 0.5 * view.height(), kAxes[view.up]);
  svg += label(view.left(), view.top - 8, "start", title);
  return svg;
}

std::string draw_path(const View& view, const Trajectory& trajectory, const char* color,
                      double width) {
  if (trajectory.empty()) return "";
  std::string commands;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const bool begins = i == 0 || trajectory[i].time - trajectory[i - 1].time > kBreak;
    const Eigen::Vector3d& p = trajectory[i].pose.translation;
    commands += fmt::format("{}{:.1f} {:.1f}", begins ? 'M' : 'L', view.page_x(p[view.right]),
                            view.page_y(p[view.up]));
  }
  return fmt::format(
      "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" "
      "stroke-linejoin=\"round\"/>\n",
      commands, color, width);
}

std::string draw_start(const View& view, const Trajectory& trajectory, const char* color) {
  if (trajectory.empty()) return "";
  const Eigen::Vector3d& p = trajectory.front().pose.translation;
  return fmt::format(
      "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4.5\" fill=\"#fff\" stroke=\"{}\" "
      "stroke-width=\"1.8\"/>\n",
      view.page_x(p[view.right]), view.page_y(p[view.up]), color);
}

std::string draw_view(const View& view, const std::string& title, const DrawnTrajectory& reference,
                      const std::vector<DrawnTrajectory>& estimates) {
  std::string svg = draw_grid(view);
  svg += draw_path(view, reference.trajectory, kReferenceColor, 3.6);
  // The first estimate is the one that matters: drawn last, on top.
  for (std::size_t i = estimates.size(); i-- > 0;) {
    svg += draw_path(view, estimates[i].trajectory, color_of(i), i == 0 ? 1.6 : 1.2);
  }
  svg += draw_start(view, reference.trajectory, kReferenceColor);
  if (!estimates.empty()) svg += draw_start(view, estimates[0].trajectory, color_of(0));
  return svg + draw_frame(view, title);
}

std::string legend_entry(double y, const char* color, double width, const std::string& name) {
  return line(kMargin, y, kMargin + 34, y,
              fmt::format("stroke=\"{}\" stroke-width=\"{}\"", color, width).c_str()) +
         label(kMargin + 44, y + 4, "start", escape(name));
}

std::string draw_legend(const DrawnTrajectory& reference,
                        const std::vector<DrawnTrajectory>& estimates) {
  double y = 24;
  std::string svg;
  if (!reference.trajectory.empty()) {
    svg += legend_entry(y, kReferenceColor, 3.6, reference.name + " (circle: begin)");
    y += kLegendLine;
  }
  for (std::size_t i = 0; i < estimates.size(); ++i, y += kLegendLine) {
    svg += legend_entry(y, color_of(i), 2, estimates[i].name);
  }
  return svg;
}

}  // namespace

std::string draw_trajectories(const DrawnTrajectory& reference,
                              const std::vector<DrawnTrajectory>& estimates) {
  const Eigen::AlignedBox3d bounds = bounds_of(reference, estimates);
  const auto [first, second, third] = axes_by_extent(bounds);
  const double scale =
      std::min((kWidth - 2 * kMargin) / bounds.sizes()[first], kMaxHeight / bounds.sizes()[second]);
  const double legend = kLegendLine * static_cast<double>(estimates.size() + 1);
  const View above = make_view(bounds, first, second, scale, legend + 48);
  const View side = make_view(bounds, first, third, scale, above.bottom() + 92);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "viewBox=\"0 0 {0:.0f} {1:.0f}\" font-family=\"sans-serif\" font-size=\"12\" "
      "fill=\"#333\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
      kWidth, side.bottom() + 56);
  svg += draw_legend(reference, estimates);
  svg += draw_view(above, "the two axes of largest extent", reference, estimates);
  svg += draw_view(side, "from the side", reference, estimates);
  return svg + "</svg>\n";
}

}  // namespace rover
