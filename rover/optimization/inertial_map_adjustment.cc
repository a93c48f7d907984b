#include "rover/optimization/inertial_map_adjustment.h"

#include <algorithm>
#include <map>

#include "rover/optimization/state_covariance.h"

namespace rover {
namespace {

// What is known of biases and velocities where no inertial data lead to a state: little.
constexpr double kGyroscopeBiasSigma = 0.1;      // rad/s
constexpr double kAccelerometerBiasSigma = 0.2;  // m/s^2
constexpr double kVelocitySigma = 10;            // m/s

// Inertial data between keyframes that both take part, unless both are fixed.
void add_links(const Map& map, InertialMapProblem& problem) {
  const auto& keyframes = problem.map.keyframes;
  const auto& fixed = problem.inertial.bundle.pose_fixed;
  std::map<KeyframeId, int> poses;
  for (std::size_t i = 0; i < keyframes.size(); ++i) poses[keyframes[i]] = static_cast<int>(i);
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const Keyframe& keyframe = map.at(keyframes[i]);
    const auto previous = poses.find(keyframe.previous);
    if (!keyframe.motion || previous == poses.end()) continue;
    if (fixed[i] && fixed[static_cast<std::size_t>(previous->second)]) continue;
    problem.inertial.links.push_back({previous->second, static_cast<int>(i), *keyframe.motion});
  }
}

// The biases that a chain of links begins with are known only roughly; a state without any link
// needs something to hold on to.
void add_priors(InertialMapProblem& problem) {
  InertialBundleProblem& inertial = problem.inertial;
  std::vector<char> reached(problem.map.keyframes.size()), linked(reached);
  for (const InertialLink& link : inertial.links) {
    reached[static_cast<std::size_t>(link.to)] = 1;
    linked[static_cast<std::size_t>(link.to)] = linked[static_cast<std::size_t>(link.from)] = 1;
  }
  for (std::size_t i = 0; i < reached.size(); ++i) {
    if (inertial.bundle.pose_fixed[i] || reached[i]) continue;
    const int pose = static_cast<int>(i);
    inertial.priors.push_back(
        {pose, bias_prior(ImuBias{}, kGyroscopeBiasSigma, kAccelerometerBiasSigma)});
    if (linked[i]) continue;
    inertial.priors.push_back({pose, velocity_prior(inertial.velocity[i], kVelocitySigma)});
  }
}

InertialMapProblem with_inertia(const Map& map, MapProblem visual) {
  InertialMapProblem problem;
  problem.inertial.bundle = std::move(visual.bundle);
  problem.map = std::move(visual);
  for (const KeyframeId id : problem.map.keyframes) {
    problem.inertial.velocity.push_back(map.at(id).velocity);
    problem.inertial.bias.push_back(map.at(id).bias);
  }
  add_links(map, problem);
  add_priors(problem);
  return problem;
}

void free_all(MapProblem& problem) { std::ranges::fill(problem.bundle.pose_fixed, char{0}); }

}  // namespace

InertialMapProblem gather_inertial_window(const Map& map, KeyframeId newest, int window,
                                          int max_fixed, const WeightingOptions& weighting) {
  std::vector<KeyframeId> free;
  KeyframeId id = newest;
  for (; id.valid() && static_cast<int>(free.size()) < window; id = map.at(id).previous) {
    free.push_back(id);
  }
  std::vector<KeyframeId> border;
  if (id.valid()) border.push_back(id);
  MapProblem problem = gather_problem(map, free, max_fixed, weighting, border);
  if (problem.keyframes.size() == free.size()) free_all(problem);
  return with_inertia(map, std::move(problem));
}

InertialMapProblem gather_inertial_map(const Map& map, const WeightingOptions& weighting) {
  MapProblem problem = gather_whole_map(map, weighting);
  free_all(problem);
  return with_inertia(map, std::move(problem));
}

void commit_inertial_adjustment(Map& map, const InertialMapProblem& problem,
                                const InertialBundleSummary& summary) {
  if (!summary.visual.usable || map.epoch() != problem.map.epoch) return;
  MapProblem visual = problem.map;
  visual.bundle = problem.inertial.bundle;
  commit_adjustment(map, visual, summary.visual);
  for (std::size_t i = 0; i < visual.keyframes.size(); ++i) {
    if (visual.bundle.pose_fixed[i]) continue;
    map.set_velocity(visual.keyframes[i], problem.inertial.velocity[i], problem.inertial.bias[i]);
  }
  keep_covariances(map, problem, summary);
}

}  // namespace rover
