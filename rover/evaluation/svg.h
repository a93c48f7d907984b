#pragma once

#include <string>
#include <string_view>
#include <vector>

// Pieces of SVG that the drawings of an evaluation are made of. Lengths in px.
namespace rover {

// One look for all drawings and pages.
inline constexpr const char* kReferenceColor = "#9a9a9a";
inline constexpr const char* kKeyframeColor = "#c23b5a";
inline constexpr const char* kLostColor = "#f9dcd8";
// Of the n-th estimate or series.
const char* series_color(std::size_t index);

// Names come from the command line and go into XML.
std::string escape_xml(std::string_view text);

// A length of 1, 2 or 5 times a power of ten that divides the extent into at most `count` parts.
double tick_step(double extent, int count);
// The multiples of the step in [low, high].
std::vector<double> ticks_within(double low, double high, double step);
// With as many decimals as the step needs.
std::string tick_text(double value, double step);

std::string svg_line(double x1, double y1, double x2, double y2, std::string_view style);
// anchor: start, middle or end.
std::string svg_text(double x, double y, const char* anchor, std::string_view text,
                     std::string_view style = "");
std::string svg_rectangle(double x, double y, double width, double height, std::string_view style);

// A drawing to be put into a page.
std::string svg_drawing(double width, double height, const std::string& content);
// A drawing made a file of its own.
std::string standalone_svg(std::string drawing);

}  // namespace rover
