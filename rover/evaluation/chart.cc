#include "rover/evaluation/chart.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "rover/evaluation/svg.h"

namespace rover {
namespace {

constexpr double kWidth = 900;
constexpr double kLeft = 64, kRight = 12;  // px, of the margins
constexpr double kAxis = 40;               // px below the inside
constexpr double kLegend = 20;
constexpr const char* kGrid = "stroke=\"#e8e8e8\"";
constexpr const char* kFrame = "fill=\"none\" stroke=\"#777\"";

// Where values lie on the page.
struct Plot {
  double left, top, width, height;      // px
  double x_low, x_high, y_low, y_high;  // values

  double x(double value) const { return left + (value - x_low) / (x_high - x_low) * width; }
  double y(double value) const { return top + (y_high - value) / (y_high - y_low) * height; }
  double bottom() const { return top + height; }
  double right() const { return left + width; }
};

// With some air above, and never without extent.
std::pair<double, double> y_range(const Chart& chart) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const auto add = [&](double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  };
  for (const ChartSeries& series : chart.series) {
    std::for_each(series.y.begin(), series.y.end(), add);
  }
  for (const auto& [level, name] : chart.levels) add(level);
  if (low > high) return {0, 1};
  if (chart.from_zero) low = std::min(low, 0.0);
  const double air = high > low ? 0.06 * (high - low) : std::max(1e-6, 0.5 * std::abs(high));
  return {chart.from_zero && low == 0 ? 0 : low - air, high + air};
}

std::string draw_axes(const Plot& plot, const Chart& chart) {
  std::string svg;
  const double x_step = tick_step(plot.x_high - plot.x_low, 12);
  for (const double x : ticks_within(plot.x_low, plot.x_high, x_step)) {
    svg += svg_line(plot.x(x), plot.top, plot.x(x), plot.bottom(), kGrid);
    svg += svg_text(plot.x(x), plot.bottom() + 16, "middle", tick_text(x, x_step));
  }
  const double y_step =
      tick_step(plot.y_high - plot.y_low, std::max(2, static_cast<int>(plot.height / 34)));
  for (const double y : ticks_within(plot.y_low, plot.y_high, y_step)) {
    svg += svg_line(plot.left, plot.y(y), plot.right(), plot.y(y), kGrid);
    svg += svg_text(plot.left - 7, plot.y(y) + 4, "end", tick_text(y, y_step));
  }
  svg += svg_text(plot.left + 0.5 * plot.width, plot.bottom() + 33, "middle", chart.x_label);
  svg += fmt::format(
      "<text transform=\"translate(14 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
      plot.top + 0.5 * plot.height, escape_xml(chart.y_label));
  return svg;
}

std::string draw_events(const Plot& plot, const Chart& chart) {
  std::string svg;
  for (const auto& [begin, end] : chart.shaded) {
    const double left = plot.x(std::max(begin, plot.x_low));
    const double right = std::max(left + 1, plot.x(std::min(end, plot.x_high)));
    svg += svg_rectangle(left, plot.top, right - left, plot.height,
                         fmt::format("fill=\"{}\"", kLostColor));
  }
  std::string commands;
  for (const double mark : chart.marks) {
    commands += fmt::format("M{:.1f} {:.1f}v-7", plot.x(mark), plot.bottom());
  }
  if (!commands.empty()) {
    svg += fmt::format("<path d=\"{}\" stroke=\"{}\"/>\n", commands, kKeyframeColor);
  }
  return svg;
}

std::string draw_levels(const Plot& plot, const Chart& chart) {
  std::string svg;
  for (const auto& [level, name] : chart.levels) {
    svg += svg_line(plot.left, plot.y(level), plot.right(), plot.y(level),
                    "stroke=\"#555\" stroke-dasharray=\"5 4\"");
    svg += svg_text(plot.right() - 4, plot.y(level) - 4, "end", name,
                    "fill=\"#444\" stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\"");
  }
  return svg;
}

// The values that fall into one pixel column: the first, the extremes and the last suffice.
class ColumnPath {
 public:
  void add(double x, double y) {
    if (std::floor(x) != column_) flush();
    if (pending_.empty()) column_ = std::floor(x);
    pending_.emplace_back(x, y);
  }
  void flush() {
    if (pending_.size() <= 4) {
      for (const auto& point : pending_) put(point);
    } else {
      const auto less = [](const auto& a, const auto& b) { return a.second < b.second; };
      const auto [low, high] = std::minmax_element(pending_.begin(), pending_.end(), less);
      put(pending_.front());
      put(std::min(*low, *high));
      put(std::max(*low, *high));
      put(pending_.back());
    }
    pending_.clear();
  }
  void lift() {
    flush();
    down_ = false;
  }
  const std::string& commands() const { return commands_; }

 private:
  void put(const std::pair<double, double>& point) {
    commands_ += fmt::format("{}{:.1f} {:.1f}", down_ ? 'L' : 'M', point.first, point.second);
    down_ = true;
  }
  double column_ = -1;
  bool down_ = false;
  std::vector<std::pair<double, double>> pending_;
  std::string commands_;
};

std::string draw_series(const Plot& plot, const ChartSeries& series) {
  ColumnPath path;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (std::isfinite(series.y[i])) {
      path.add(plot.x(series.x[i]), plot.y(series.y[i]));
    } else {
      path.lift();
    }
  }
  path.flush();
  if (path.commands().empty()) return "";
  return fmt::format(
      "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.3\" "
      "stroke-linejoin=\"round\" stroke-linecap=\"round\"/>\n",
      path.commands(), series.color);
}

bool has_legend(const Chart& chart) {
  return std::any_of(chart.series.begin(), chart.series.end(),
                     [](const ChartSeries& series) { return !series.name.empty(); });
}

std::string draw_legend(const Chart& chart) {
  double x = kLeft;
  std::string svg;
  for (const ChartSeries& series : chart.series) {
    if (series.name.empty()) continue;
    svg += svg_line(x, 10, x + 22, 10,
                    fmt::format("stroke=\"{}\" stroke-width=\"2.4\"", series.color));
    svg += svg_text(x + 28, 14, "start", series.name);
    x += 28 + 7.0 * static_cast<double>(series.name.size()) + 24;
  }
  return svg;
}

double at_share(const std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1) + 0.5)];
}

std::vector<int> count_bars(const std::vector<double>& sorted, double low, double high, int bars) {
  std::vector<int> counts(static_cast<std::size_t>(bars));
  for (const double value : sorted) {
    const double place = (value - low) / (high - low) * bars;
    ++counts[static_cast<std::size_t>(std::clamp(static_cast<int>(place), 0, bars - 1))];
  }
  return counts;
}

std::string draw_bars(const Plot& plot, const std::vector<int>& counts) {
  const double width = plot.width / static_cast<double>(counts.size());
  std::string svg;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] == 0) continue;
    const double top = plot.y(counts[i]);
    svg += svg_rectangle(plot.left + static_cast<double>(i) * width + 0.5, top, width - 1,
                         plot.bottom() - top, "fill=\"#7aa6d0\"");
  }
  return svg;
}

std::string draw_quantile(const Plot& plot, double value, const char* color) {
  return svg_line(plot.x(value), plot.top, plot.x(value), plot.bottom(),
                  fmt::format("stroke=\"{}\" stroke-width=\"1.5\"", color));
}

}  // namespace

std::string draw_chart(const Chart& chart) {
  const double legend = has_legend(chart) ? kLegend : 0;
  const auto [low, high] = y_range(chart);
  const double x_high = std::max(chart.x_high, chart.x_low + 1e-6);
  const Plot plot{kLeft, legend + 8, kWidth - kLeft - kRight, chart.height, chart.x_low, x_high,
                  low,   high};
  std::string svg = draw_axes(plot, chart) + draw_events(plot, chart);
  for (auto series = chart.series.rbegin(); series != chart.series.rend(); ++series) {
    svg += draw_series(plot, *series);
  }
  svg += draw_levels(plot, chart);
  svg += svg_rectangle(plot.left, plot.top, plot.width, plot.height, kFrame) + draw_legend(chart);
  return svg_drawing(kWidth, plot.bottom() + kAxis, svg);
}

std::string draw_histogram(const std::string& title, const std::string& x_label,
                           std::vector<double> values) {
  constexpr int kBars = 24;
  constexpr double kHistogramWidth = 290;
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return "";
  std::sort(values.begin(), values.end());
  const double high = std::max(at_share(values, 0.99), 1e-6);
  const auto counts = count_bars(values, 0, high, kBars);
  const Plot plot{14,
                  40,
                  kHistogramWidth - 28,
                  84,
                  0,
                  high,
                  0,
                  1.05 * *std::max_element(counts.begin(), counts.end())};
  const double median = at_share(values, 0.5), p95 = at_share(values, 0.95);
  std::string svg = svg_text(plot.left, 14, "start", title, "font-weight=\"600\"");
  svg += svg_text(plot.left, 30, "start",
                  fmt::format("median {:.3g}, 95% {:.3g}, max {:.3g} ({} times)", median, p95,
                              values.back(), values.size()),
                  "fill=\"#666\" font-size=\"11\"");
  const double step = tick_step(high, 6);
  for (const double x : ticks_within(0, high, step)) {
    svg += svg_text(plot.x(x), plot.bottom() + 14, "middle", tick_text(x, step));
  }
  svg += draw_bars(plot, counts);
  svg += draw_quantile(plot, std::min(median, high), series_color(0)) +
         draw_quantile(plot, std::min(p95, high), series_color(1));
  svg += svg_line(plot.left, plot.bottom(), plot.right(), plot.bottom(), "stroke=\"#777\"");
  svg += svg_text(plot.right(), plot.bottom() + 28, "end", x_label, "fill=\"#666\"");
  return svg_drawing(kHistogramWidth, plot.bottom() + 34, svg);
}

}  // namespace rover
