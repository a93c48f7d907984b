// Pose optimisation, point refinement and bundle adjustment on simulated problems of the sizes
// that tracking and mapping meet.

#include <benchmark/benchmark.h>

#include "rover/optimization/bundle_adjustment.h"
#include "rover/optimization/point_refinement.h"
#include "rover/optimization/pose_optimization.h"
#include "rover/optimization/simulated_bundle.h"

namespace rover {
namespace {

// Argument: observations. One pose, a tenth of outliers, a prediction some centimetres off.
void BM_PoseOptimization(benchmark::State& state) {
  const int wanted = static_cast<int>(state.range(0));
  const auto bundle = simulate_bundle({.fixed_poses = 0,
                                       .free_poses = 1,
                                       .points = 20 * wanted,
                                       .outliers = 0.1,
                                       .pose_error = 0.05});
  std::vector<PoseObservation> observations;
  for (const BundleObservation& seen : bundle.truth.observations) {
    if (static_cast<int>(observations.size()) == wanted) break;
    observations.push_back({bundle.truth.points[seen.point], seen.pixel, seen.camera, seen.sigma});
  }
  if (static_cast<int>(observations.size()) < wanted)
    return state.SkipWithError("too few observations");
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        optimize_pose(bundle.truth.rig, bundle.problem.world_from_body[0], observations, {}));
  }
}
BENCHMARK(BM_PoseOptimization)->Arg(100)->Arg(400)->Arg(1000)->Unit(benchmark::kMicrosecond);

// Argument: views of the point.
void BM_PointRefinement(benchmark::State& state) {
  const int views = static_cast<int>(state.range(0));
  const auto bundle = simulate_bundle(
      {.fixed_poses = 0, .free_poses = views, .points = 50, .poses_per_point = views});
  std::vector<PointObservation> observations;
  const int point = bundle.truth.observations.front().point;
  for (const BundleObservation& seen : bundle.truth.observations) {
    if (seen.point == point)
      observations.push_back(
          {bundle.truth.world_from_body[seen.pose], seen.pixel, seen.camera, seen.sigma});
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        refine_point(bundle.truth.rig, observations, bundle.problem.points[point]));
  }
}
BENCHMARK(BM_PointRefinement)->Arg(2)->Arg(5)->Unit(benchmark::kMicrosecond);

// Arguments: fixed and free poses, points, solver. Ends when converged, as in use.
void BM_BundleAdjustment(benchmark::State& state) {
  const auto bundle = simulate_bundle({.fixed_poses = static_cast<int>(state.range(0)),
                                       .free_poses = static_cast<int>(state.range(1)),
                                       .points = static_cast<int>(state.range(2)),
                                       .poses_per_point = 7,
                                       .outliers = 0.03});
  const BundleOptions options{.solver = static_cast<BundleSolver>(state.range(3))};
  BundleSummary summary;
  for (auto _ : state) {
    state.PauseTiming();
    BundleProblem problem = bundle.problem;
    state.ResumeTiming();
    summary = adjust_bundle(problem, options);
  }
  state.counters["observations"] = static_cast<double>(bundle.problem.observations.size());
  state.counters["iterations"] = summary.iterations;
  state.counters["cost"] = summary.final_cost;
  state.SetLabel(options.solver == BundleSolver::kSchur ? "schur" : "ceres");
}
constexpr int kSchur = static_cast<int>(BundleSolver::kSchur);
constexpr int kCeres = static_cast<int>(BundleSolver::kCeres);
BENCHMARK(BM_BundleAdjustment)
    ->Args({12, 12, 2500, kSchur})
    ->Args({12, 12, 2500, kCeres})
    ->Args({2, 60, 8000, kSchur})
    ->Args({2, 60, 8000, kCeres})
    ->Args({1, 150, 20000, kSchur})
    ->Args({1, 150, 20000, kCeres})
    ->Args({1, 300, 40000, kSchur})
    ->Args({1, 300, 40000, kCeres})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace rover

BENCHMARK_MAIN();
