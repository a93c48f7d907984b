#include "rover/optimization/bundle_adjustment.h"

#include <cstring>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/optimization/simulated_bundle.h"

namespace rover {
namespace {

double largest_pose_error(const BundleProblem& a, const BundleProblem& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.world_from_body.size(); ++i)
    worst = std::max(worst, se3_minus(a.world_from_body[i], b.world_from_body[i]).norm());
  return worst;
}

void expect_same_bytes(const BundleProblem& a, const BundleProblem& b) {
  for (std::size_t i = 0; i < a.world_from_body.size(); ++i) {
    const SE3 &p = a.world_from_body[i], &q = b.world_from_body[i];
    EXPECT_EQ(std::memcmp(p.rotation.coeffs().data(), q.rotation.coeffs().data(), 32), 0);
    EXPECT_EQ(std::memcmp(p.translation.data(), q.translation.data(), 24), 0);
  }
  for (std::size_t i = 0; i < a.points.size(); ++i)
    EXPECT_EQ(std::memcmp(a.points[i].data(), b.points[i].data(), 24), 0);
}

class BundleAdjustmentTest : public testing::TestWithParam<BundleSolver> {
 protected:
  BundleOptions options() const { return {.solver = GetParam()}; }
};

TEST_P(BundleAdjustmentTest, FindsTheTruthWithoutNoise) {
  for (const Camera& camera : {simulated_pinhole(), simulated_fisheye()}) {
    for (const int cameras : {1, 2}) {
      const BundleSimulation simulation{.rig = simulated_rig(camera, cameras), .sigma = 0};
      auto [truth, problem, outliers] = simulate_bundle(simulation);
      const auto summary = adjust_bundle(problem, options());
      EXPECT_TRUE(summary.usable);
      EXPECT_LT(summary.final_cost, 1e-6 * summary.initial_cost);
      EXPECT_LT(largest_pose_error(problem, truth), 1e-5);
      EXPECT_EQ(summary.inliers, std::vector<char>(problem.observations.size(), 1));
    }
  }
}

// Where both cameras' places share their errors, disparities hold the scale.
TEST_P(BundleAdjustmentTest, DisparitiesHoldTheScale) {
  BundleSimulation simulation{.fixed_poses = 1, .sigma = 0};
  simulation.rig = simulated_rig(simulated_pinhole(), 2);
  const SimulatedBundle simulated = simulate_bundle(simulation);
  BundleProblem problem = with_disparities(simulated.problem);
  Random random(4);
  for (BundleObservation& seen : problem.observations) {
    if (seen.camera == 0) seen.pixel += 0.1 * Eigen::Vector2d(random.gaussian(), random.gaussian());
  }
  ASSERT_TRUE(adjust_bundle(problem, options()).usable);
  EXPECT_LT(largest_pose_error(problem, simulated.truth), 2e-3);
}

TEST_P(BundleAdjustmentTest, RemovesOutliers) {
  auto [truth, problem, is_outlier] = simulate_bundle({.sigma = 0.3, .outliers = 0.2, .seed = 3});
  const double before = largest_pose_error(problem, truth);
  const auto summary = adjust_bundle(problem, options());
  EXPECT_TRUE(summary.usable);
  EXPECT_LT(largest_pose_error(problem, truth), 0.5 * before);
  int kept_outliers = 0, kept_inliers = 0, outliers = 0, inliers = 0;
  for (std::size_t i = 0; i < is_outlier.size(); ++i) {
    (is_outlier[i] ? outliers : inliers) += 1;
    (is_outlier[i] ? kept_outliers : kept_inliers) += summary.inliers[i];
  }
  EXPECT_LT(kept_outliers, 0.1 * outliers);
  EXPECT_GT(kept_inliers, 0.8 * inliers);
}

TEST_P(BundleAdjustmentTest, FixedPosesAndUnseenPartsStay) {
  auto [truth, problem, outliers] = simulate_bundle({});
  problem.points.emplace_back(1, 2, 3);
  problem.world_from_body.emplace_back(so3_exp({1, 2, 3}), Eigen::Vector3d(4, 5, 6));
  problem.pose_fixed.push_back(0);
  const BundleProblem before = problem;
  EXPECT_TRUE(adjust_bundle(problem, options()).usable);
  EXPECT_EQ(problem.points.back(), before.points.back());
  for (std::size_t i = 0; i < problem.pose_fixed.size(); ++i) {
    if (!problem.pose_fixed[i] && i + 1 < problem.pose_fixed.size()) continue;
    EXPECT_EQ(problem.world_from_body[i].translation, before.world_from_body[i].translation);
    EXPECT_TRUE(problem.world_from_body[i].rotation.coeffs().isApprox(
        before.world_from_body[i].rotation.coeffs(), 1e-15));
  }
}

TEST_P(BundleAdjustmentTest, HoldsTheScale) {
  BundleSimulation simulation{.fixed_poses = 1, .sigma = 0.5};
  simulation.rig.body_from_camera[0] = SE3();
  auto [truth, problem, outliers] = simulate_bundle(simulation);
  const auto distance = [&] {
    return (problem.world_from_body.back().translation - problem.world_from_body[0].translation)
        .norm();
  };
  const double before = distance();
  BundleOptions held = options();
  held.fix_scale = true;
  const auto summary = adjust_bundle(problem, held);
  EXPECT_TRUE(summary.usable);
  EXPECT_NEAR(distance(), before, 1e-12);
  EXPECT_LT(summary.final_cost, 0.1 * summary.initial_cost);
  EXPECT_GT(largest_pose_error(problem, truth), 0);
}

TEST_P(BundleAdjustmentTest, ReportsEmptyProblems) {
  BundleProblem problem;
  EXPECT_FALSE(adjust_bundle(problem, options()).usable);
  problem = simulate_bundle({}).problem;
  problem.observations.clear();
  const BundleProblem before = problem;
  const auto summary = adjust_bundle(problem, options());
  EXPECT_FALSE(summary.usable);
  EXPECT_TRUE(summary.inliers.empty());
  expect_same_bytes(problem, before);
}

TEST_P(BundleAdjustmentTest, SurvivesPosesAndPointsThatAreHardlySeen) {
  auto [truth, problem, outliers] = simulate_bundle({.seed = 5});
  auto& seen = problem.observations;
  int of_last_pose = 0;
  const int last = static_cast<int>(problem.world_from_body.size()) - 1;
  std::erase_if(seen, [&](const auto& s) {
    if (s.point < 20) return s.pose != 4;         // at most one view
    return s.pose == last && ++of_last_pose > 2;  // two points for six unknowns
  });
  const auto summary = adjust_bundle(problem, options());
  EXPECT_TRUE(summary.usable);
  EXPECT_LT(summary.final_cost, summary.initial_cost);
  for (const auto& point : problem.points) EXPECT_TRUE(point.allFinite());
  for (const SE3& pose : problem.world_from_body) EXPECT_TRUE(pose.translation.allFinite());
}

// Each fits there what its camera has seen, and nothing else does.
TEST_P(BundleAdjustmentTest, PointsInTheCentreOfACameraDoNotHoldIt) {
  auto [truth, problem, outliers] = simulate_bundle({.sigma = 0.3, .seed = 6});
  const int held = static_cast<int>(problem.world_from_body.size()) - 1;
  const SE3 world_from_camera = problem.world_from_body[held] * problem.rig.body_from_camera[0];
  const int points = static_cast<int>(problem.points.size());
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector2d pixel(200 + 30 * i, 150 + 20 * i);
    const auto ray = problem.rig.cameras[0].unproject(pixel);
    ASSERT_TRUE(ray);
    problem.points.push_back(world_from_camera * (1e-6 * *ray));
    problem.observations.push_back({held, points + i, 0, pixel, 1});
    problem.observations.push_back({held - 1, points + i, 0, pixel, 1});
  }
  const auto summary = adjust_bundle(problem, options());
  EXPECT_TRUE(summary.usable);
  EXPECT_LT(largest_pose_error(problem, truth), 0.05);
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    const BundleObservation& seen = problem.observations[i];
    if (seen.point >= points && seen.pose == held) {
      EXPECT_FALSE(summary.inliers[i]);
    }
  }
}

TEST_P(BundleAdjustmentTest, PointsBehindTheirCamerasBecomeOutliers) {
  auto [truth, problem, outliers] = simulate_bundle({.sigma = 0.3, .seed = 6});
  for (int i = 0; i < 10; ++i) problem.points[i].z() = -5;
  const auto summary = adjust_bundle(problem, options());
  EXPECT_TRUE(summary.usable);
  EXPECT_LT(largest_pose_error(problem, truth), 0.05);
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    if (problem.observations[i].point < 10) {
      EXPECT_FALSE(summary.inliers[i]);
    }
  }
}

// There the distortion polynomial of a pinhole camera is beyond all bounds.
TEST_P(BundleAdjustmentTest, PointsInTheCamerasPlaneDoNotDominate) {
  auto [truth, problem, outliers] = simulate_bundle({.sigma = 0.3, .seed = 10});
  for (auto& seen : problem.observations) {
    if (seen.point >= 5) continue;
    const SE3 camera = problem.world_from_body[seen.pose] * problem.rig.body_from_camera[0];
    problem.points[seen.point] = camera * Eigen::Vector3d(1, 0.5, 1e-3);
  }
  const auto summary = adjust_bundle(problem, options());
  int misfits = 0;
  EXPECT_TRUE(summary.usable);
  EXPECT_LT(largest_pose_error(problem, truth), 0.05);
  for (std::size_t i = 0; i < problem.observations.size(); ++i)
    misfits += problem.observations[i].point >= 5 && !summary.inliers[i];
  EXPECT_LT(misfits, 0.1 * static_cast<double>(problem.observations.size()));
}

TEST_P(BundleAdjustmentTest, WithAllPosesFixedThePointsAreRefined) {
  auto [truth, problem, outliers] = simulate_bundle({.fixed_poses = 8, .free_poses = 0});
  const BundleProblem before = problem;
  const auto summary = adjust_bundle(problem, options());
  EXPECT_TRUE(summary.usable);
  EXPECT_LT(summary.final_cost, 0.2 * summary.initial_cost);
  EXPECT_LT(largest_pose_error(problem, before), 1e-15);
}

TEST_P(BundleAdjustmentTest, NothingChangesWhenValuesAreNotFinite) {
  auto [truth, problem, outliers] = simulate_bundle({});
  problem.points[problem.observations[0].point].setConstant(
      std::numeric_limits<double>::quiet_NaN());
  const BundleProblem before = problem;
  EXPECT_FALSE(adjust_bundle(problem, options()).usable);
  expect_same_bytes(problem, before);
}

TEST_P(BundleAdjustmentTest, GivesTheSameBytesTwice) {
  const auto simulated = simulate_bundle({.outliers = 0.1, .seed = 7});
  BundleProblem a = simulated.problem, b = simulated.problem;
  const auto first = adjust_bundle(a, options());
  const std::vector<double> memory_in_between(12345, 1.0);  // other addresses for the second run
  const auto second = adjust_bundle(b, options());
  EXPECT_EQ(first.inliers, second.inliers);
  EXPECT_EQ(first.final_cost, second.final_cost);
  expect_same_bytes(a, b);
}

TEST_P(BundleAdjustmentTest, DoesNotDependOnTheWorldFrame) {
  BundleSimulation simulation{.seed = 8};  // no outliers: a single minimum
  simulation.rig.body_from_camera[0] = SE3();
  Random random(9);
  BundleProblem here = simulate_bundle(simulation).problem;
  BundleProblem there = moved(here, random_pose(random, 10), 1.7);
  BundleOptions long_run = options();
  long_run.min_relative_decrease = 1e-12;
  long_run.first_iterations = 100;
  long_run.second_iterations = 100;
  const auto a = adjust_bundle(here, long_run), b = adjust_bundle(there, long_run);
  EXPECT_NEAR(a.initial_cost, b.initial_cost, 1e-9 * a.initial_cost);
  EXPECT_NEAR(a.final_cost, b.final_cost, 1e-6 * a.final_cost);
  EXPECT_EQ(a.inliers, b.inliers);
}

TEST_P(BundleAdjustmentTest, StopsWhenAsked) {
  auto [truth, problem, outliers] = simulate_bundle({});
  BundleOptions stopping = options();
  int asked = 0;
  stopping.should_stop = [&] { return ++asked == 2; };
  const auto summary = adjust_bundle(problem, stopping);
  EXPECT_TRUE(summary.usable);
  EXPECT_EQ(summary.iterations, 2);
  EXPECT_EQ(asked, 2);
  EXPECT_LT(summary.final_cost, summary.initial_cost);
}

TEST_P(BundleAdjustmentTest, RefusesWhatMakesNoSense) {
  const BundleProblem good = simulate_bundle({}).problem;
  const auto refused = [&](auto&& change) {
    BundleProblem problem = good;
    change(problem);
    EXPECT_THROW(adjust_bundle(problem, options()), std::invalid_argument);
  };
  refused([](BundleProblem& p) { p.observations[0].pose = 99; });
  refused([](BundleProblem& p) { p.observations[0].point = -1; });
  refused([](BundleProblem& p) { p.observations[0].camera = 1; });
  refused([](BundleProblem& p) { p.observations[0].sigma = 0; });
  refused([](BundleProblem& p) { p.pose_fixed.pop_back(); });
  refused([](BundleProblem& p) { p.pose_fixed.assign(p.pose_fixed.size(), 0); });
}

INSTANTIATE_TEST_SUITE_P(Solvers, BundleAdjustmentTest,
                         testing::Values(BundleSolver::kSchur, BundleSolver::kCeres),
                         [](const auto& solver) {
                           return solver.param == BundleSolver::kSchur ? "Schur" : "Ceres";
                         });

// Both solvers, run to convergence, end in the same minimum.
TEST(BundleAdjustment, SchurAgreesWithCeres) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    BundleSimulation simulation{.outliers = 0.05 * static_cast<double>(seed % 3), .seed = seed};
    simulation.rig =
        simulated_rig(seed % 2 ? simulated_pinhole() : simulated_fisheye(), seed % 4 < 2 ? 1 : 2);
    simulation.fixed_poses = seed % 3 == 0 ? 1 : 2;
    BundleProblem ours = simulate_bundle(simulation).problem;
    if (seed % 4 == 3) ours = with_disparities(ours);
    BundleProblem theirs = ours;
    BundleOptions options{.first_iterations = 100, .second_iterations = 100};
    options.fix_scale = ours.rig.size() == 1;
    options.min_relative_decrease = 1e-13;
    options.solver = BundleSolver::kSchur;
    const auto a = adjust_bundle(ours, options);
    options.solver = BundleSolver::kCeres;
    const auto b = adjust_bundle(theirs, options);
    ASSERT_TRUE(a.usable && b.usable);
    EXPECT_EQ(a.inliers, b.inliers) << seed;
    EXPECT_NEAR(a.final_cost, b.final_cost, 1e-6 * b.final_cost) << seed;
    EXPECT_LT(largest_pose_error(ours, theirs), 1e-3) << seed;
  }
}

// Above 60 poses Ceres factorises a sparse reduced system, above 300 it is the automatic choice.
TEST(BundleAdjustment, LargeProblemsEndInTheSameMinimum) {
  const auto cost_of = [](BundleProblem problem, BundleSolver solver) {
    const BundleOptions options{.first_iterations = 50,
                                .second_iterations = 50,
                                .min_relative_decrease = 1e-12,
                                .solver = solver};
    return adjust_bundle(problem, options).final_cost;
  };
  const auto sparse = simulate_bundle({.free_poses = 80, .points = 1500}).problem;
  const double reference = cost_of(sparse, BundleSolver::kCeres);
  EXPECT_NEAR(cost_of(sparse, BundleSolver::kSchur), reference, 1e-6 * reference);
  EXPECT_EQ(cost_of(sparse, BundleSolver::kAutomatic), cost_of(sparse, BundleSolver::kSchur));
  const auto large = simulate_bundle({.free_poses = 301, .points = 3000}).problem;
  EXPECT_EQ(cost_of(large, BundleSolver::kAutomatic), cost_of(large, BundleSolver::kCeres));
}

TEST(BundleAdjustment, RefusesOptionsThatMakeNoSense) {
  const auto refused = [](const BundleOptions& options) {
    BundleProblem problem;
    EXPECT_THROW(adjust_bundle(problem, options), InputError);
  };
  refused({.first_iterations = 0});
  refused({.second_iterations = -1});
  refused({.chi2 = 0});
  refused({.huber = -1});
  refused({.min_relative_decrease = -1});
  refused({.threads = 0});
}

}  // namespace
}  // namespace rover
