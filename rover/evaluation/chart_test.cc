#include "rover/evaluation/chart.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/datasets/test_folder.h"
#include "rover/evaluation/base64.h"
#include "rover/evaluation/point_cloud.h"
#include "rover/evaluation/svg.h"

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

auto is_drawing() {
  return AllOf(HasSubstr("<svg"), HasSubstr("</svg>"), Not(HasSubstr("nan")),
               Not(HasSubstr("inf\"")));
}

TEST(Svg, TicksAreRound) {
  EXPECT_DOUBLE_EQ(tick_step(10, 10), 1);
  EXPECT_DOUBLE_EQ(tick_step(11, 10), 2);
  EXPECT_DOUBLE_EQ(tick_step(0.3, 10), 0.05);
  EXPECT_THAT(ticks_within(-1, 4.1, 2), ElementsAre(0, 2, 4));
  EXPECT_EQ(tick_text(0.3, 0.05), "0.30");
  EXPECT_EQ(tick_text(-1e-12, 0.5), "0.0");
}

TEST(Chart, DrawsLinesEventsAndLevels) {
  Chart chart;
  chart.y_label = "a<b";
  chart.x_high = 10;
  chart.series = {{"one", "#123456", {0, 1, 2, 3, 4}, {1, 2, kNan, 3, 4}}};
  chart.shaded = {{2, 3}};
  chart.marks = {1, 5};
  chart.levels = {{2.5, "limit"}};
  const std::string svg = draw_chart(chart);
  EXPECT_THAT(svg, AllOf(is_drawing(), HasSubstr("a&lt;b"), HasSubstr("one"), HasSubstr("limit"),
                         HasSubstr(kLostColor), HasSubstr(kKeyframeColor)));
  const auto path = svg.substr(0, svg.find("stroke=\"#123456\" stroke-width=\"1.3\""));
  const auto commands = path.substr(path.rfind("d=\""));
  EXPECT_EQ(std::count(commands.begin(), commands.end(), 'M'), 2);  // broken where it is unknown
  EXPECT_THAT(draw_chart({}), is_drawing());
}

TEST(Chart, KeepsExtremesOfManyValues) {
  Chart chart;
  chart.x_high = 1000;
  ChartSeries series{"", "#123456", {}, {}};
  for (int i = 0; i < 100'000; ++i) {
    series.x.push_back(0.01 * i);
    series.y.push_back(i == 54'321 ? 50 : 1);
  }
  chart.series = {series};
  const std::string svg = draw_chart(chart);
  EXPECT_LT(svg.size(), 80'000u);
  // 50 of a range of 53 in 170 px, 8 px from the top.
  EXPECT_THAT(svg, HasSubstr(fmt::format(" {:.1f}L", 8 + 170 * (1 - 50 / (50 + 0.06 * 50)))));
}

TEST(Histogram, TellsMedianAndQuantile) {
  std::vector<double> values(99, 1.0);
  values.push_back(100);
  const std::string svg = draw_histogram("stage & more", "ms", values);
  EXPECT_THAT(svg, AllOf(is_drawing(), HasSubstr("median 1, 95% 1, max 100 (100 times)"),
                         HasSubstr("stage &amp; more")));
  EXPECT_EQ(draw_histogram("none", "ms", {kNan}), "");
}

TEST(Base64, FollowsTheStandard) {
  const auto encode = [](const std::string& text) {
    return base64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  };
  // RFC 4648, section 10.
  EXPECT_EQ(encode(""), "");
  EXPECT_EQ(encode("f"), "Zg==");
  EXPECT_EQ(encode("fo"), "Zm8=");
  EXPECT_EQ(encode("foo"), "Zm9v");
  EXPECT_EQ(encode("foob"), "Zm9vYg==");
  EXPECT_EQ(encode("fooba"), "Zm9vYmE=");
  EXPECT_EQ(encode("foobar"), "Zm9vYmFy");
}

constexpr const char* kPlyHeader =
    "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";

TEST(PointCloud, ReadsWhatRunsWrite) {
  const TestFolder folder;
  const float position[3] = {1, -2, 0.5F};
  std::string data = kPlyHeader;
  data.append(reinterpret_cast<const char*>(position), sizeof(position));
  data += "\x01\x02\x03";
  folder.write("map.ply", data);
  const auto points = read_point_cloud(folder / "map.ply");
  ASSERT_THAT(points, SizeIs(1));
  EXPECT_EQ(points[0].position, Eigen::Vector3d(1, -2, 0.5));
  EXPECT_THAT(points[0].color, ElementsAre(1, 2, 3));
  folder.write("map.ply", data.substr(0, data.size() - 1));
  EXPECT_THAT(input_error_of([&] { read_point_cloud(folder / "map.ply"); }),
              HasSubstr("ends early"));
  for (const std::string broken : {"", "ply\n", "ply\nformat ascii 1.0\nend_header\n"}) {
    folder.write("map.ply", broken);
    EXPECT_THAT(input_error_of([&] { read_point_cloud(folder / "map.ply"); }),
                HasSubstr("map.ply"));
  }
}

TEST(PointCloud, IsDrawnWithoutItsOutliers) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 1000; ++i) points.emplace_back(0.01 * (i % 100), 0.1 * (i / 100), 0);
  points.emplace_back(5000, 0, 0);
  const std::string svg = draw_map(points, {Eigen::Vector3d(0.5, 0.5, 0)});
  EXPECT_THAT(svg, AllOf(is_drawing(), HasSubstr("data:image/png;base64,"), HasSubstr("<circle"),
                         Not(HasSubstr("5000"))));
  EXPECT_THAT(draw_map({}, {}), is_drawing());
}

}  // namespace
}  // namespace rover
