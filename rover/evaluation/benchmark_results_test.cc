#include "rover/evaluation/benchmark_results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/datasets/test_folder.h"
#include "rover/evaluation/benchmark_page.h"

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using Json = nlohmann::json;

const Json kSummary = Json::parse(R"({
  "coverage": 0.9, "frame_ms": {"median": 15, "p95": 40}, "dropped_frames": 3, "keyframes": 20,
  "stages": {"features": {"median": 8, "p95": 9, "max": 30}}, "families": ["orb"]})");
const Json kEvaluation = Json::parse(R"({
  "headline": "sim3", "initialised_after_s": 0.5, "trajectories": {
    "final": {"coverage": 0.9, "longest_gap_s": 0.2, "se3": null,
      "sim3": {"ate_m": {"rmse": 0.02, "std": 0.01}, "rpe_frame_m": {"rmse": 0.005, "std": 0.001},
               "rpe_frame_deg": {"rmse": 0.3}, "drift": null,
               "rpe_distance": {"translation_percent": 1.5, "rotation_deg_per_m": 0.1}}},
    "causal": {"sim3": {"ate_m": {"rmse": 0.03}}},
    "peer": {"coverage": 1, "sim3": {"ate_m": {"rmse": 0.01}}}}})");

TEST(BenchmarkFigures, ComeFromTheFilesOfARun) {
  const Figures figures = figures_of_run(kSummary, kEvaluation);
  EXPECT_EQ(figures.at("ate_rmse"), 0.02);
  EXPECT_EQ(figures.at("ate_std"), 0.01);
  EXPECT_EQ(figures.at("causal_ate_rmse"), 0.03);
  EXPECT_DOUBLE_EQ(figures.at("rpe_rmse"), 5);
  EXPECT_EQ(figures.at("rpe_percent"), 1.5);
  EXPECT_DOUBLE_EQ(figures.at("coverage"), 90);
  EXPECT_EQ(figures.at("initialised_after"), 0.5);
  EXPECT_EQ(figures.at("frame_p95"), 40);
  EXPECT_EQ(figures.at("stage.features.p95"), 9);
  EXPECT_FALSE(figures.contains("drift_percent"));
}

TEST(BenchmarkFigures, HaveWhatCountsForLivePoses) {
  Json evaluation = kEvaluation;
  evaluation["live"] = Json::parse(R"({"coverage": 0.99, "late_ate_m": {"rmse": 0.02},
    "early_scale": {"percent": -1.5}, "final_scale": {"percent": 0.5}, "causal_step": {"m": 0.03},
    "odometry_step": {"m": 0.001}, "final_gaps": {"inside_m": {"rmse": 0.04}},
    "dead_reckoning": [{"drift_m": 0.05}, {"drift_m": 0.07}, {"drift_m": null}]})");
  const Figures figures = figures_of_run(kSummary, evaluation);
  EXPECT_EQ(figures.at("late_causal_ate"), 0.02);
  EXPECT_EQ(figures.at("early_scale_error"), 1.5);  // how far off, whichever way
  EXPECT_EQ(figures.at("final_scale_error"), 0.5);
  EXPECT_DOUBLE_EQ(figures.at("causal_step"), 30);
  EXPECT_DOUBLE_EQ(figures.at("odometry_step"), 1);
  EXPECT_DOUBLE_EQ(figures.at("coverage_after"), 99);
  EXPECT_EQ(figures.at("gap_ate"), 0.04);
  EXPECT_EQ(figures.at("gap_drift"), 0.07);
}

TEST(BenchmarkFigures, AreFewerWithoutGroundTruthAndForOthers) {
  const Figures blind = figures_of_run(kSummary, nullptr);
  EXPECT_FALSE(blind.contains("ate_rmse"));
  EXPECT_DOUBLE_EQ(blind.at("coverage"), 90);
  const Figures peer = figures_of_trajectory(kEvaluation, "peer");
  EXPECT_EQ(peer, (Figures{{"ate_rmse", 0.01}, {"coverage", 100}}));
  EXPECT_TRUE(figures_of_trajectory(kEvaluation, "nobody").empty());
  EXPECT_TRUE(figures_of_run("text", Json::array()).empty());
}

BenchmarkRun run_of(const std::string& configuration, std::uint64_t seed, Figures figures,
                    const std::string& failure = "") {
  return {{"desk", "mono", configuration}, seed,    1,
          "runs/" + configuration,         failure, std::move(figures)};
}

std::vector<BenchmarkRun> four_runs() {
  return {
      run_of(
          "a", 1,
          {{"ate_rmse", 0.3}, {"coverage", 80}, {"stage.pose.median", 2}, {"stage.pose.p95", 4}}),
      run_of("a", 2, {{"ate_rmse", 0.1}, {"coverage", 100}}),
      run_of("a", 3, {{"ate_rmse", 0.2}, {"coverage", 90}}),
      run_of("a", 4, {}, "said \"no\", <then> fell")};
}

TEST(BenchmarkCells, HaveTheMedianAndTheWorst) {
  auto runs = four_runs();
  runs.push_back(run_of("b", 1, {{"ate_rmse", 0.5}}));
  const auto cells = summarize(runs);
  ASSERT_THAT(cells, SizeIs(2));
  EXPECT_EQ(cells[0].runs, 4u);
  EXPECT_EQ(cells[0].failed, 1u);
  const FigureSummary ate = cells[0].figures.at("ate_rmse");
  EXPECT_EQ(ate.count, 3u);
  EXPECT_EQ(ate.median, 0.2);
  EXPECT_EQ(ate.worst, 0.3);
  EXPECT_EQ(cells[0].figures.at("coverage").worst, 80);  // here more is better
  EXPECT_EQ(format_summary(cells[0], figure_kind("ate_rmse")), "0.2000 (0.3000)");
  EXPECT_EQ(format_summary(cells[1], figure_kind("ate_rmse")), "0.5000");
  EXPECT_EQ(format_summary(cells[1], figure_kind("coverage")), "-");
}

TEST(BenchmarkTables, ShowCellsSideBySide) {
  auto runs = four_runs();
  runs.push_back({{"street", "stereo", "b"}, 1, 1, "", "", {{"ate_rmse", 0.5}}});
  const auto rows = side_by_side(summarize(runs));
  EXPECT_EQ(rows, (TableRows{{"ATE rmse [m]", "a", "b"},
                             {"desk mono", "0.2000 (0.3000)", ""},
                             {"street stereo", "", "0.5000"}}));
  const std::string text = format_benchmark(summarize(runs));
  EXPECT_THAT(text, AllOf(HasSubstr("4 (1)"), HasSubstr("coverage [%]"), HasSubstr("2.00, 4.00")));
}

TEST(BenchmarkTables, HaveALinePerRunInCsv) {
  const std::string csv = benchmark_csv(four_runs());
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 5);
  EXPECT_THAT(csv, AllOf(HasSubstr("desk,mono,a,1,1,,80,0.3,"), HasSubstr("stage.pose.median"),
                         HasSubstr(",\"said \"\"no\"\", <then> fell\",")));
  const auto json = benchmark_json(four_runs());
  EXPECT_EQ(json["cells"][0]["figures"]["ate_rmse"]["median"], 0.2);
  EXPECT_EQ(json["runs"][3]["failure"], "said \"no\", <then> fell");
}

TEST(BenchmarkPage, LinksReportsAndDrawsTrajectories) {
  const TestFolder folder;
  std::string path;
  for (int i = 0; i < 20; ++i) path += fmt::format("{} {} {} 0 0 0 0 1\n", i, 0.1 * i, i % 3);
  folder.write("runs/a/trajectory_aligned.txt", path);
  folder.write("runs/a/trajectory_reference.txt", path);
  folder.write("runs/a/report.html", "");
  const std::string page = benchmark_page("a<b", folder.path(), four_runs());
  EXPECT_THAT(
      page, AllOf(HasSubstr("a&lt;b"), HasSubstr("href=\"runs/a/report.html\""), HasSubstr("<path"),
                  HasSubstr("&lt;then&gt; fell"), Not(HasSubstr("http"))));
}

}  // namespace
}  // namespace rover
