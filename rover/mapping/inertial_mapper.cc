#include "rover/mapping/inertial_mapper.h"

#include <algorithm>
#include <numeric>

#include "rover/base/error.h"

namespace rover {
namespace {

// The newest keyframes that inertial data link without a break, in order of time.
std::vector<KeyframeId> linked_keyframes(const Map& map, KeyframeId newest, int most) {
  std::vector<KeyframeId> chain;
  for (KeyframeId id = newest; id.valid(); id = map.at(id).previous) {
    chain.push_back(id);
    if (!map.at(id).motion || static_cast<int>(chain.size()) == most) break;
  }
  std::ranges::reverse(chain);
  return chain;
}

InitializationProblem gather_initialization(const Map& map, const std::vector<KeyframeId>& chain) {
  InitializationProblem problem;
  problem.body_from_camera = map.rig().body_from_camera[0];
  problem.metric = map.rig().size() > 1;
  for (const KeyframeId id : chain) {
    problem.world_from_camera.push_back(map.at(id).world_from_body() * problem.body_from_camera);
    if (id != chain.front()) problem.motions.push_back(*map.at(id).motion);
  }
  return problem;
}

// Turns and scales a map, and gives its keyframes velocities and biases. Keyframes made since the
// initialisation was gathered follow the last one by integration.
void align(Map& map, const std::vector<KeyframeId>& chain, const InitializationResult& result) {
  map.transform(result.aligned_from_world);
  for (std::size_t i = 0; i < chain.size(); ++i) {
    map.set_velocity(chain[i], result.states[i].velocity, result.states[i].bias);
  }
  const auto follow = [&](KeyframeId id) { return id.valid() ? map.at(id).next : id; };
  for (KeyframeId id = follow(chain.back()); id.valid(); id = follow(id)) {
    const Keyframe& keyframe = map.at(id);
    const InertialState before = map.at(keyframe.previous).state();
    const InertialState after =
        keyframe.motion ? keyframe.motion->predict(before, gravity_of_z_up()) : before;
    map.set_velocity(id, after.velocity, before.bias);
  }
  const Timestamp now = map.at(chain.back()).frame.time;
  map.set_inertial({true, now, now, 0, result.scale_sigma});
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(std::max<std::size_t>(1, values.size()));
}

}  // namespace

void InertialMapperOptions::check() const {
  require(window > 1 && stereo_window > 1, "inertial.window and stereo_window must be above 1");
  require(min_keyframes >= 3 && max_keyframes >= min_keyframes,
          "inertial.min_keyframes must be at least 3 and at most max_keyframes");
  require(first_refinement > 0 && refinement_interval > 0,
          "inertial.first_refinement and refinement_interval must be positive");
  require(max_reprojection_ratio > 1, "inertial.max_reprojection_ratio is {}; use more than 1",
          max_reprojection_ratio);
  initialization.check();
  adjustment.check();
}

InertialMapper::InertialMapper(const InertialMapperOptions& options,
                               const WeightingOptions& weighting)
    : options_(options), weighting_(weighting) {
  options_.check();
}

InertialReport InertialMapper::adjust_window(SharedMap& shared, KeyframeId keyframe, int max_fixed,
                                             const BundleOptions& options) const {
  const auto view = shared.view();
  const int window = view->rig().size() > 1 ? options_.stereo_window : options_.window;
  InertialMapProblem problem =
      gather_inertial_window(*view, keyframe, window, max_fixed, weighting_);
  const auto newest = std::ranges::find(problem.map.keyframes, keyframe);
  const InertialBundleSummary summary = adjust_inertial_bundle(
      problem.inertial, {options, false, static_cast<int>(newest - problem.map.keyframes.begin())});
  const InertialStatus status = view->inertial();
  const double age = seconds_between(status.begin, view->at(keyframe).frame.time);
  if (age < options_.trial_period && !is_plausible(problem, summary)) {
    shared.commit([&](Map& map) {
      map.set_inertial({});
      map.raise_epoch();
    });
    return {InertialEvent::kUndone, status.scale_sigma, ""};
  }
  shared.commit([&](Map& map) { commit_inertial_adjustment(map, problem, summary); });
  return {};
}

InertialReport InertialMapper::advance(SharedMap& shared, KeyframeId keyframe) const {
  const auto view = shared.view();
  if (!view->inertial().aligned) return initialize(shared, keyframe);
  if (needs_refinement(*view, view->at(keyframe).frame.time)) return refine(shared, keyframe);
  return {};
}

// Everything is tried on a copy of the map first.
InertialReport InertialMapper::initialize(SharedMap& shared, KeyframeId keyframe) const {
  const auto view = shared.view();
  const auto chain = linked_keyframes(*view, keyframe, options_.max_keyframes);
  if (static_cast<int>(chain.size()) < options_.min_keyframes) {
    return {InertialEvent::kNone, 0, "needs more keyframes with inertial data between them"};
  }
  const InitializationResult result =
      initialize_inertial(gather_initialization(*view, chain), options_.initialization);
  if (!result.accepted) return {InertialEvent::kNone, result.scale_sigma, result.missing};
  Map trial = *view;
  trial.freeze();
  align(trial, chain, result);
  InertialMapProblem problem = gather_inertial_map(trial, weighting_);
  const auto summary = adjust_inertial_bundle(problem.inertial, {options_.adjustment, true});
  const double growth = summary.visual.final_cost / std::max(1.0, summary.visual.initial_cost);
  if (!is_plausible(problem, summary) ||
      growth > options_.max_reprojection_ratio * options_.max_reprojection_ratio) {
    return {InertialEvent::kNone, result.scale_sigma,
            "camera and inertial sensor do not fit together yet: needs more motion"};
  }
  shared.commit([&](Map& map) {
    align(map, chain, result);
    commit_inertial_adjustment(map, problem, summary);
  });
  return {InertialEvent::kInitialized, result.scale_sigma, ""};
}

bool InertialMapper::is_plausible(const InertialMapProblem& problem,
                                  const InertialBundleSummary& summary) const {
  if (!summary.visual.usable || mean(summary.link_chi2) > options_.max_link_chi2) return false;
  return std::ranges::all_of(problem.inertial.bias, [&](const ImuBias& bias) {
    return bias.gyroscope.norm() < options_.max_gyroscope_bias &&
           bias.accelerometer.norm() < options_.max_accelerometer_bias;
  });
}

// Twice at least; more often while the scale is uncertain.
bool InertialMapper::needs_refinement(const Map& map, Timestamp now) const {
  constexpr int kAlways = 2;
  const InertialStatus& status = map.inertial();
  if (static_cast<int>(map.keyframes().size()) > options_.max_refined) return false;
  if (status.refinements >= kAlways && status.scale_sigma < options_.scale_sigma) return false;
  const double wait =
      status.refinements == 0 ? options_.first_refinement : options_.refinement_interval;
  return seconds_between(status.refined, now) >= wait;
}

InertialReport InertialMapper::refine(SharedMap& shared, KeyframeId keyframe) const {
  const auto view = shared.view();
  InertialMapProblem problem = gather_inertial_map(*view, weighting_);
  const auto summary = adjust_inertial_bundle(problem.inertial, {options_.adjustment, true});
  if (!summary.visual.usable) return {};
  InertialStatus status = view->inertial();
  status.refined = view->at(keyframe).frame.time;
  status.refinements += 1;
  if (!summary.covariance.empty()) status.scale_sigma = summary.scale_sigma;
  shared.commit([&](Map& map) {
    commit_inertial_adjustment(map, problem, summary);
    map.set_inertial(status);
    map.raise_epoch();
  });
  return {InertialEvent::kRefined, status.scale_sigma, ""};
}

}  // namespace rover
