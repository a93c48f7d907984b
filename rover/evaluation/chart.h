#pragma once

#include <string>
#include <vector>

namespace rover {

// A line of a chart. A value that is not finite breaks it.
struct ChartSeries {
  std::string name;  // empty: not in the legend
  const char* color = "#333";
  std::vector<double> x, y;
};

// Values over time, with what happened marked.
struct Chart {
  std::string y_label;  // with its unit
  std::string x_label = "time [s]";
  double x_low = 0, x_high = 1;  // what is shown
  bool from_zero = true;         // the y axis; else from the least value
  double height = 170;           // px, of the inside
  std::vector<ChartSeries> series;
  std::vector<std::pair<double, double>> shaded;       // stretches of x
  std::vector<double> marks;                           // x, as short lines at the bottom
  std::vector<std::pair<double, std::string>> levels;  // y, as dashed lines with a name
};

// A drawing (see svg.h) 900 px wide, with axes, ticks and a legend if a series has a name. Of very
// many values it draws the extremes of each pixel column.
std::string draw_chart(const Chart& chart);

// How often which values occur: a drawing 290 px wide with the median and the 95% quantile marked.
// Values beyond the 99% quantile count into the last bar.
std::string draw_histogram(const std::string& title, const std::string& x_label,
                           std::vector<double> values);

}  // namespace rover
