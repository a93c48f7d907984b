#include "rover/optimization/inertial_map_adjustment.h"

#include <algorithm>
#include <map>
#include <set>

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
    if (fixed[i]) continue;
    problem.inertial.links.push_back({previous->second, static_cast<int>(i), *keyframe.motion});
  }
}

// What is known of a state from before it. The alignment tells of the keyframes before it with all
// that came after them, too: windows that begin there would count that twice.
StatePrior forward_prior(const Map& map, const Keyframe& keyframe) {
  const auto prior = keyframe.frame.time < map.inertial().begin ? std::nullopt : prior_of(keyframe);
  return prior.value_or(bias_prior(ImuBias{}, kGyroscopeBiasSigma, kAccelerometerBiasSigma));
}

// The state before the window is known as it was before the window's links: with these, and with
// what is seen along them, it is found anew. Biases that nobody has estimated are known roughly.
void add_border(const Map& map, KeyframeId before, InertialMapProblem& problem) {
  const auto found = std::ranges::find(problem.map.keyframes, before);
  const int pose = static_cast<int>(found - problem.map.keyframes.begin());
  InertialBundleProblem& inertial = problem.inertial;
  const auto begins = [&](const InertialLink& link) { return link.from == pose; };
  if (std::ranges::none_of(inertial.links, begins)) return;
  inertial.border = pose;
  inertial.priors.push_back({pose, forward_prior(map, map.at(before))});
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

// Where the body stood still.
void add_rest(const Map& map, InertialMapProblem& problem) {
  for (std::size_t i = 0; i < problem.map.keyframes.size(); ++i) {
    const double sigma = map.at(problem.map.keyframes[i]).still_sigma;
    if (sigma == 0 || problem.inertial.bundle.pose_fixed[i]) continue;
    problem.inertial.priors.push_back({static_cast<int>(i), zero_velocity_prior(sigma)});
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
  add_rest(map, problem);
  return problem;
}

void free_all(MapProblem& problem) { std::ranges::fill(problem.bundle.pose_fixed, char{0}); }

// The rest of a map whose newest keyframes have moved freely: what lies before them moves with the
// oldest of them, landmarks that took no part move with the keyframe that saw them first.
void carry_rest(Map& map, const MapProblem& problem, double scale) {
  const std::vector<KeyframeId>& moved = problem.keyframes;  // ascending
  const std::set<LandmarkId> taken(problem.landmarks.begin(), problem.landmarks.end());
  std::vector<KeyframeId> keyframes;
  for (const Keyframe& keyframe : map.keyframes()) {
    if (keyframe.id < moved.front()) keyframes.push_back(keyframe.id);
  }
  std::vector<std::pair<LandmarkId, KeyframeId>> landmarks;
  for (const Landmark& landmark : map.landmarks()) {
    const KeyframeId first = landmark.observations.front().keyframe;
    const bool is_new = first > problem.newest;
    if (!is_new && !taken.contains(landmark.id)) landmarks.emplace_back(landmark.id, first);
  }
  for (const KeyframeId id : keyframes) map.move(id, motion_of(problem, 0, scale));
  for (const auto& [id, first] : landmarks) {
    const auto after = std::ranges::upper_bound(moved, first);
    const auto pose = after == moved.begin() ? 0 : after - moved.begin() - 1;
    map.move(id, motion_of(problem, static_cast<std::size_t>(pose), scale));
  }
}

}  // namespace

std::vector<KeyframeId> keyframes_backwards(const Map& map, KeyframeId from, int most) {
  std::vector<KeyframeId> result;
  for (; from.valid() && static_cast<int>(result.size()) < most; from = map.at(from).previous)
    result.push_back(from);
  return result;
}

InertialMapProblem gather_inertial_window(const Map& map, KeyframeId newest, int window,
                                          int max_fixed, const WeightingOptions& weighting) {
  const std::vector<KeyframeId> free = keyframes_backwards(map, newest, window);
  std::vector<KeyframeId> border;
  const KeyframeId before = map.at(free.back()).previous;
  if (before.valid()) border.push_back(before);
  MapProblem problem = gather_problem(map, free, max_fixed, weighting, border);
  if (problem.keyframes.size() == free.size()) free_all(problem);
  InertialMapProblem result = with_inertia(map, std::move(problem));
  if (before.valid()) add_border(map, before, result);
  return result;
}

InertialMapProblem gather_newest(const Map& map, int most, const WeightingOptions& weighting) {
  MapProblem problem =
      gather_problem(map, keyframes_backwards(map, map.newest_keyframe(), most), 0, weighting);
  free_all(problem);
  return with_inertia(map, std::move(problem));
}

bool is_free(const InertialMapProblem& problem) {
  return std::ranges::count(problem.inertial.bundle.pose_fixed, 1) == 0;
}

void commit_inertial_adjustment(Map& map, const InertialMapProblem& problem,
                                const InertialBundleSummary& summary) {
  if (!summary.visual.usable || map.epoch() != problem.map.epoch) return;
  MapProblem visual = problem.map;
  visual.bundle = problem.inertial.bundle;
  const double scale = is_free(problem) ? scale_change(visual) : 1;
  if (is_free(problem)) {
    carry_rest(map, visual, scale);
    map.rescale(scale);
  }
  commit_adjustment(map, visual, summary.visual, scale);
  for (std::size_t i = 0; i < visual.keyframes.size(); ++i) {
    if (visual.bundle.pose_fixed[i] && static_cast<int>(i) != problem.inertial.border) continue;
    map.set_velocity(visual.keyframes[i], problem.inertial.velocity[i], problem.inertial.bias[i]);
  }
  keep_covariances(map, problem, summary, scale);
}

double scale_change(const MapProblem& problem) {
  const SE3& body_from_camera = problem.bundle.rig.body_from_camera[0];
  const auto way = [&](const std::vector<SE3>& world_from_body, std::size_t i) {
    return (world_from_body[i] * body_from_camera.translation -
            world_from_body[i - 1] * body_from_camera.translation)
        .norm();
  };
  double product = 0, square = 0;
  for (std::size_t i = 1; i < problem.keyframes.size(); ++i) {
    const double then = way(problem.initial_poses, i);
    product += then * way(problem.bundle.world_from_body, i);
    square += then * then;
  }
  return square > 0 ? product / square : 1;
}

}  // namespace rover
