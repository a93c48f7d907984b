#include "rover/evaluation/point_cloud.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "rover/base/error.h"
#include "rover/datasets/text_rows.h"
#include "rover/evaluation/base64.h"
#include "rover/evaluation/plan_view.h"
#include "rover/evaluation/svg.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBytesPerPoint = 3 * sizeof(float) + 3;

struct Header {
  std::size_t points = 0;
  std::size_t size = 0;  // bytes
};

Header read_header(std::string_view text, const fs::path& file) {
  constexpr std::string_view kEnd = "end_header\n", kCount = "element vertex ";
  constexpr std::string_view kProperties =
      "property float x\nproperty float y\nproperty float z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\n";
  const auto end = text.find(kEnd);
  const auto count = text.find(kCount);
  require(text.starts_with("ply\nformat binary_little_endian 1.0\n") && end != text.npos &&
              count < end && text.substr(0, end).find(kProperties) != text.npos,
          "{}: is not a map as rover run writes it", file.string());
  const std::string_view number = text.substr(count + kCount.size());
  const double points = parse_number(number.substr(0, number.find('\n')));
  require(points >= 0 && points < 1e9, "{}: says that it holds {} points", file.string(), points);
  return {static_cast<std::size_t>(points), end + kEnd.size()};
}

// Of one axis: from the 1% to the 99% quantile and half of that on either side.
std::pair<double, double> usual_range(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
  };
  const double reach = 0.5 * (at(0.99) - at(0.01));
  return {at(0.01) - reach, at(0.99) + reach};
}

Eigen::AlignedBox3d usual_box(const std::vector<Eigen::Vector3d>& points,
                              const std::vector<Eigen::Vector3d>& places) {
  Eigen::AlignedBox3d box;
  if (!points.empty()) {
    Eigen::Vector3d low, high;
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (const auto& point : points) values.push_back(point[axis]);
      std::tie(low[axis], high[axis]) = usual_range(std::move(values));
    }
    for (const auto& point : points) {
      if ((point.array() >= low.array() && point.array() <= high.array()).all()) box.extend(point);
    }
  }
  for (const auto& place : places) box.extend(place);
  return box_around(box);
}

// Gray values that fall with the number of points in a pixel; twice as fine as the page.
std::string picture_of(const PlanView& view, const std::vector<Eigen::Vector3d>& points) {
  constexpr double kFiner = 2;
  cv::Mat counts = cv::Mat::zeros(static_cast<int>(kFiner * view.height()) + 1,
                                  static_cast<int>(kFiner * view.width()) + 1, CV_32F);
  for (const auto& point : points) {
    const double x = kFiner * (view.page_x(point) - view.left);
    const double y = kFiner * (view.page_y(point) - view.top);
    if (!(x >= 0 && x < counts.cols && y >= 0 && y < counts.rows)) continue;
    for (const int dy : {0, 1}) {
      for (const int dx : {0, 1}) {
        const int row = std::min(static_cast<int>(y) + dy, counts.rows - 1);
        const int column = std::min(static_cast<int>(x) + dx, counts.cols - 1);
        counts.at<float>(row, column) += 1;
      }
    }
  }
  cv::Mat picture(counts.size(), CV_8U);
  for (int row = 0; row < counts.rows; ++row) {
    for (int column = 0; column < counts.cols; ++column) {
      const double gray = 255 - 255 * (1 - std::exp(-1.1 * counts.at<float>(row, column)));
      picture.at<std::uint8_t>(row, column) = static_cast<std::uint8_t>(gray);
    }
  }
  std::vector<std::uint8_t> png;
  cv::imencode(".png", picture, png);
  return fmt::format(
      "<image x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" href=\"{}\"/>\n",
      view.left, view.top, counts.cols / kFiner, counts.rows / kFiner, data_url("image/png", png));
}

std::string draw_view(const PlanView& view, const std::string& title,
                      const std::vector<Eigen::Vector3d>& points,
                      const std::vector<Eigen::Vector3d>& places) {
  std::string svg = picture_of(view, points) + draw_grid(view);
  for (const auto& place : places) {
    svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2\" fill=\"{}\"/>\n",
                       view.page_x(place), view.page_y(place), kKeyframeColor);
  }
  return svg + draw_frame(view, title);
}

}  // namespace

std::vector<ColoredPoint> read_point_cloud(const fs::path& file) {
  static_assert(std::endian::native == std::endian::little);
  const std::string text = read_text_file(file);
  const Header header = read_header(text, file);
  require((text.size() - header.size) / kBytesPerPoint >= header.points,
          "{}: ends early; was the run ended early?", file.string());
  std::vector<ColoredPoint> points;
  points.reserve(header.points);
  for (std::size_t i = 0; i < header.points; ++i) {
    const char* bytes = text.data() + header.size + i * kBytesPerPoint;
    Eigen::Vector3f position;
    ColoredPoint point;
    std::memcpy(position.data(), bytes, 3 * sizeof(float));
    std::memcpy(point.color.data(), bytes + 3 * sizeof(float), 3);
    point.position = position.cast<double>();
    if (point.position.allFinite()) points.push_back(point);
  }
  return points;
}

std::string draw_map(const std::vector<Eigen::Vector3d>& points,
                     const std::vector<Eigen::Vector3d>& places) {
  PlanLayout layout;
  const PlanViews views = lay_out(usual_box(points, places), layout);
  return svg_drawing(layout.width, views.height,
                     draw_view(views.above, "along the axis of least extent", points, places) +
                         draw_view(views.side, "from the side", points, places));
}

}  // namespace rover
