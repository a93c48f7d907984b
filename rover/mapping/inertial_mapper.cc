#include "rover/mapping/inertial_mapper.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include <fmt/format.h>

#include "rover/base/error.h"
#include "rover/mapping/map_alignment.h"

namespace rover {
namespace {

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(std::max<std::size_t>(1, values.size()));
}

// The newest keyframes of a map adjusted by what they see alone, as if there were no inertial data.
MapProblem gather_visual(const Map& map, int most, const WeightingOptions& weighting) {
  const auto free = keyframes_backwards(map, map.newest_keyframe(), most);
  const bool is_all = !map.at(free.back()).previous.valid();
  return gather_problem(map, free, is_all ? 0 : most, weighting);
}

// The visual part of a problem, adjusted.
BundleSummary adjust_without_inertia(const InertialMapProblem& problem,
                                     const BundleOptions& options) {
  MapProblem visual = problem.map;
  visual.bundle = problem.inertial.bundle;
  if (std::ranges::count(visual.bundle.pose_fixed, 1) == 0) visual.bundle.pose_fixed.front() = 1;
  return adjust(visual, options);
}

std::string describe_scale(double sigma, double wanted) {
  return fmt::format("scale is known to {:.1f}% ({:.0f}% needed): needs more of this motion",
                     100 * sigma, 100 * wanted);
}

}  // namespace

void InertialMapperOptions::check() const {
  require(window > 1 && stereo_window > 1, "inertial.window and stereo_window must be above 1");
  require(min_keyframes >= 3 && max_keyframes >= min_keyframes,
          "inertial.min_keyframes must be at least 3 and at most max_keyframes");
  require(first_refinement > 0 && refinement_interval > 0 && soonest_refinement > 0,
          "inertial.first_refinement, soonest_refinement and refinement_interval must be positive");
  require(max_refined >= min_keyframes,
          "inertial.max_refined is {}; use inertial.min_keyframes or more", max_refined);
  require(max_reprojection_ratio > 1, "inertial.max_reprojection_ratio is {}; use more than 1",
          max_reprojection_ratio);
  require(first_calibration > 0 && calibration_interval > 0,
          "inertial.first_calibration and calibration_interval must be positive");
  require(max_calibrated >= min_keyframes,
          "inertial.max_calibrated is {}; use inertial.min_keyframes or more", max_calibrated);
  initialization.check();
  calibration.check();
  adjustment.check();
}

InertialMapper::InertialMapper(const InertialMapperOptions& options,
                               const WeightingOptions& weighting)
    : options_(options), weighting_(weighting) {
  options_.check();
}

InertialReport InertialMapper::adjust_window(SharedMap& shared, KeyframeId keyframe, int max_fixed,
                                             const BundleOptions& given) const {
  const auto view = shared.view();
  const int window = view->rig().size() > 1 ? options_.stereo_window : options_.window;
  InertialMapProblem problem =
      gather_inertial_window(*view, keyframe, window, max_fixed, weighting_);
  const auto newest = std::ranges::find(problem.map.keyframes, keyframe);
  const int newest_pose = static_cast<int>(newest - problem.map.keyframes.begin());
  const bool on_trial = is_on_trial(*view, keyframe);
  BundleOptions options = given;
  if (on_trial) options.should_stop = {};  // half an adjustment is no ground to judge on
  const auto before = on_trial ? std::optional(problem) : std::nullopt;
  const auto summary =
      adjust_inertial_bundle(problem.inertial, {.bundle = options, .covariance_of = newest_pose});
  if (before && (!is_plausible(problem, summary) ||
                 is_bent(summary, adjust_without_inertia(*before, options)))) {
    return undo(shared, keyframe);
  }
  const bool may_scale = is_free(problem) || !view->inertial().scale_settled;
  shared.commit([&](Map& map) {
    commit_inertial_adjustment(map, problem, summary);
    if (may_scale) map.raise_epoch();
  });
  return {};
}

bool InertialMapper::is_on_trial(const Map& map, KeyframeId keyframe) const {
  const double age = seconds_between(map.inertial().begin, map.at(keyframe).frame.time);
  return age < options_.trial_period;
}

bool InertialMapper::is_bent(const InertialBundleSummary& summary,
                             const BundleSummary& visual) const {
  if (!visual.usable) return false;
  const double ratio = std::sqrt(summary.visual.final_cost / std::max(1.0, visual.final_cost));
  return ratio > options_.max_reprojection_ratio;
}

// What wrong inertial data have bent is adjusted by vision alone. Scale and gravity are left as
// they are: without inertial data they mean nothing.
InertialReport InertialMapper::undo(SharedMap& shared, KeyframeId keyframe) const {
  const auto view = shared.view();
  MapProblem problem = gather_visual(*view, options_.max_refined, weighting_);
  const BundleSummary summary = adjust(problem, options_.adjustment);
  shared.commit([&](Map& map) {
    commit_adjustment(map, problem, summary);
    for (const KeyframeId id : problem.keyframes) map.set_velocity(id, Eigen::Vector3d::Zero(), {});
    map.set_inertial({.undone = map.at(keyframe).frame.time});
    map.raise_epoch();
  });
  return {InertialEvent::kUndone, view->inertial().scale_sigma, ""};
}

InertialReport InertialMapper::advance(SharedMap& shared, KeyframeId keyframe) const {
  const auto view = shared.view();
  const Timestamp now = view->at(keyframe).frame.time;
  if (!view->inertial().aligned) {
    if (options_.calibration.time_offset) shift_coarsely(shared, keyframe);
    return initialize(shared, keyframe);
  }
  if (needs_calibration(*view, now)) {
    const InertialReport report = calibrate(shared, keyframe);
    if (report.event != InertialEvent::kNone) return report;
  }
  if (needs_refinement(*view, now)) return refine(shared, keyframe);
  return {};
}

// How well the scale is known, the adjustment with all that was seen decides.
InertialMapper::Trial InertialMapper::try_alignment(Map map,
                                                    const std::vector<KeyframeId>& chain) const {
  Trial trial;
  trial.alignment = initialize_inertial(gather_initialization(map, chain), options_.initialization);
  trial.scale_sigma = trial.alignment.scale_sigma;
  trial.missing = trial.alignment.missing;
  if (!trial.alignment.accepted) return trial;
  map.freeze();
  align(map, chain, trial.alignment);
  trial.problem = gather_newest(map, options_.max_refined, weighting_);
  const InertialMapProblem before = trial.problem;
  trial.summary = adjust_inertial_bundle(
      trial.problem.inertial,
      {.bundle = options_.adjustment, .covariance = true, .scale_sigma = true});
  trial.scale_sigma = trial.summary.scale_sigma;
  const bool is_metric = map.rig().size() > 1;
  if (!is_plausible(trial.problem, trial.summary) ||
      is_bent(trial.summary, adjust_without_inertia(before, options_.adjustment))) {
    trial.missing = "camera and inertial sensor do not fit together yet: needs more motion";
  } else if (!is_metric && !is_certain(trial.scale_sigma)) {
    trial.missing = describe_scale(trial.scale_sigma, options_.initialization.max_scale_sigma);
  }
  return trial;
}

InertialReport InertialMapper::initialize(SharedMap& shared, KeyframeId keyframe) const {
  const auto view = shared.view();
  const auto chain = linked_keyframes(*view, keyframe, options_.max_keyframes);
  if (static_cast<int>(chain.size()) < options_.min_keyframes) {
    return {
        InertialEvent::kNone, 0,
        fmt::format("needs motion: {} of {} keyframes with inertial data between them are there",
                    chain.size(), options_.min_keyframes)};
  }
  const Trial trial = try_alignment(*view, chain);
  if (!trial.missing.empty()) return {InertialEvent::kNone, trial.scale_sigma, trial.missing};
  const Timestamp now = view->at(keyframe).frame.time;
  shared.commit([&](Map& map) {
    align(map, chain, trial.alignment);
    commit_inertial_adjustment(map, trial.problem, trial.summary);
    map.set_inertial({.aligned = true,
                      .begin = now,
                      .refined = now,
                      .scale_sigma = trial.scale_sigma,
                      .scale_settled = is_settled(map, trial.scale_sigma),
                      .undone = map.inertial().undone});
  });
  return {InertialEvent::kInitialized, trial.scale_sigma, ""};
}

// Zero: not determined at all.
bool InertialMapper::is_certain(double scale_sigma) const {
  return scale_sigma > 0 && scale_sigma <= options_.initialization.max_scale_sigma;
}

bool InertialMapper::is_settled(const Map& map, double scale_sigma) const {
  return map.rig().size() > 1 || (scale_sigma > 0 && scale_sigma < options_.scale_sigma);
}

bool InertialMapper::is_plausible(const InertialMapProblem& problem,
                                  const InertialBundleSummary& summary) const {
  if (!summary.visual.usable || mean(summary.link_chi2) > options_.max_link_chi2) return false;
  return std::ranges::all_of(problem.inertial.bias, [&](const ImuBias& bias) {
    return bias.gyroscope.norm() < options_.max_gyroscope_bias &&
           bias.accelerometer.norm() < options_.max_accelerometer_bias;
  });
}

// Twice at least; more often while the scale is uncertain, so that it comes right in small steps.
bool InertialMapper::needs_refinement(const Map& map, Timestamp now) const {
  constexpr double kGrowth = 0.5;
  const InertialStatus& status = map.inertial();
  const double age = seconds_between(status.begin, now);
  const double last = seconds_between(status.begin, status.refined);
  const auto passes = [&](double time) { return last < time && age >= time; };
  if (passes(options_.first_refinement) ||
      passes(options_.first_refinement + options_.refinement_interval)) {
    return true;
  }
  const double wait =
      std::max(options_.soonest_refinement, std::min(kGrowth * last, options_.refinement_interval));
  return !status.scale_settled && age - last >= wait;
}

// All states are free, so that scale and gravity can still move: an adjustment of the window could
// not, its border is fixed. Bounded: a long way before the newest keyframes says little more.
InertialReport InertialMapper::refine(SharedMap& shared, KeyframeId keyframe) const {
  const auto view = shared.view();
  InertialMapProblem problem = gather_newest(*view, options_.max_refined, weighting_);
  const auto summary = adjust_inertial_bundle(
      problem.inertial, {.bundle = options_.adjustment, .covariance = true, .scale_sigma = true});
  InertialStatus status = view->inertial();
  status.refined = view->at(keyframe).frame.time;
  status.refinements += 1;
  if (summary.scale_sigma > 0) status.scale_sigma = summary.scale_sigma;
  status.scale_settled = is_settled(*view, status.scale_sigma);
  shared.commit([&](Map& map) {
    commit_inertial_adjustment(map, problem, summary);
    map.set_inertial(status);
    map.raise_epoch();
  });
  return {InertialEvent::kRefined, status.scale_sigma, ""};
}

}  // namespace rover
