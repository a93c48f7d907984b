#include "rover/evaluation/report.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rover/datasets/test_folder.h"
#include "rover/evaluation/trajectory_svg.h"

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

Trajectory circle(double radius) {
  Trajectory trajectory;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d p(radius * std::cos(0.1 * i), radius * std::sin(0.1 * i),
                            0.01 * radius * i);
    trajectory.push_back({from_seconds(0.1 * i), SE3(Eigen::Quaterniond::Identity(), p)});
  }
  return trajectory;
}

TEST(Judgement, SaysWhatFitsAndWhatIsCovered) {
  const auto judgement =
      judge("half", circle(1), circle(2), 0.02, Offered{120, 0, from_seconds(11.9)});
  EXPECT_EQ(judgement.poses, 60u);
  EXPECT_EQ(judgement.associated, 60u);
  EXPECT_DOUBLE_EQ(*judgement.coverage, 0.5);
  EXPECT_NEAR(judgement.longest_gap, 6, 1e-9);
  EXPECT_NEAR(judgement.similarity->reference_from_estimate.scale, 2, 1e-9);
  EXPECT_LT(judgement.similarity->position.rmse, 1e-9);
  EXPECT_GT(judgement.rigid->position.rmse, 0.8);
  const auto json = to_json(judgement);
  EXPECT_EQ(json["sim3"]["ate_m"]["rmse"], judgement.similarity->position.rmse);
  EXPECT_EQ(json["coverage"], 0.5);
}

TEST(Judgement, RefusesTrajectoriesOfOtherTimes) {
  Trajectory later = circle(1);
  for (auto& stamped : later) stamped.time += from_seconds(100);
  EXPECT_THAT(input_error_of([&] { judge("late", later, circle(1), 0.02, std::nullopt); }),
              AllOf(HasSubstr("late"), HasSubstr("clock")));
}

TEST(Judgement, LeavesOutWhatIsNotDetermined) {
  const Trajectory two = {{0, SE3()}, {100'000'000, SE3()}};
  const auto judgement = judge("two", two, circle(1), 0.02, std::nullopt);
  EXPECT_FALSE(judgement.rigid || judgement.similarity || judgement.gravity);
  EXPECT_TRUE(to_json(judgement)["se3"].is_null());
  EXPECT_THAT(format_table({judgement}, {}), HasSubstr("ATE SE(3), rmse [m]"));
}

TEST(Table, HasOneColumnPerTrajectory) {
  const auto one = judge("one", circle(1), circle(1), 0.02, std::nullopt);
  const auto other = judge("other", circle(1), circle(2), 0.02, std::nullopt);
  ReportOptions options;
  options.rigid = false;
  options.headline = AlignmentKind::kSimilarity;
  const std::string table = format_table({one, other}, options);
  EXPECT_THAT(table, AllOf(HasSubstr("one"), HasSubstr("other"), HasSubstr("ATE Sim(3)"),
                           Not(HasSubstr("SE(3)")), Not(HasSubstr("4-DoF"))));
  std::size_t width = table.find('\n');
  for (std::size_t at = 0; at < table.size(); at += width + 1) EXPECT_EQ(table[at + width], '\n');
}

TEST(Drawing, ShowsEveryTrajectoryAndEscapesNames) {
  const std::string svg = draw_trajectories({"truth", circle(1)}, {{"a<b>&\"c\"", circle(1.1)}});
  EXPECT_THAT(svg, AllOf(HasSubstr("truth"), HasSubstr("a&lt;b&gt;&amp;&quot;c&quot;"),
                         HasSubstr("x [m]"), HasSubstr("z [m]")));
  const auto count = [&](const std::string& what) {
    std::size_t n = 0;
    for (auto at = svg.find(what); at != std::string::npos; at = svg.find(what, at + 1)) ++n;
    return n;
  };
  EXPECT_EQ(count("<path"), 4u);  // two trajectories in two views
  EXPECT_EQ(count("<path d=\"M"), 4u);
}

TEST(Drawing, BreaksLinesAtGaps) {
  Trajectory broken = circle(1);
  broken.erase(broken.begin() + 20, broken.begin() + 40);
  const std::string svg = draw_trajectories({"", {}}, {{"broken", broken}});
  const auto path = svg.substr(svg.find("<path"));
  EXPECT_EQ(std::count(path.begin(), path.begin() + static_cast<long>(path.find("/>")), 'M'), 2);
}

TEST(Drawing, TakesPointsAndNothing) {
  for (const Trajectory& trajectory : {Trajectory{}, Trajectory{{0, SE3()}}}) {
    const std::string svg = draw_trajectories({"truth", trajectory}, {{"estimate", trajectory}});
    EXPECT_THAT(svg, AllOf(HasSubstr("</svg>"), Not(HasSubstr("nan")), Not(HasSubstr("inf"))));
  }
}

}  // namespace
}  // namespace rover
