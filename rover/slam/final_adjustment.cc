#include "rover/slam/final_adjustment.h"

#include "rover/optimization/inertial_map_adjustment.h"

namespace rover {
namespace {

void adjust_visually(SharedMap& shared, const Config& config) {
  MapProblem problem = gather_whole_map(*shared.view(), config.mapping.creation.weighting);
  const BundleSummary summary = adjust(problem, config.final_adjustment);
  shared.commit([&](Map& map) { commit_adjustment(map, problem, summary); });
}

void adjust_with_inertia(SharedMap& shared, const Config& config) {
  InertialMapProblem problem =
      gather_newest(*shared.view(), config.max_finally_adjusted, config.mapping.creation.weighting);
  const auto summary = adjust_inertial_bundle(
      problem.inertial, {.bundle = config.final_adjustment, .scale_sigma = true});
  InertialStatus status = shared.view()->inertial();
  if (summary.scale_sigma > 0) status.scale_sigma = summary.scale_sigma;
  shared.commit([&](Map& map) {
    commit_inertial_adjustment(map, problem, summary);
    map.set_inertial(status);
  });
}

}  // namespace

void adjust_finally(SharedMap& map, const Config& config) {
  if (map.view()->inertial().aligned) {
    adjust_with_inertia(map, config);
  } else {
    adjust_visually(map, config);
  }
}

}  // namespace rover
