#include "rover/optimization/state_covariance.h"

#include <algorithm>

#include "rover/optimization/drift.h"

namespace rover {
namespace {

// s: ties wander by less as keyframes are culled.
constexpr double kRevisit = 2;

// What the fixed states of a window have drifted in the mean, and how old they are.
struct Ties {
  Eigen::Matrix4d drift = Eigen::Matrix4d::Zero();
  double anchor = 0;
};

// What each pose shares with a window: the points that it sees, and inertial data.
std::vector<double> shares_of(const InertialBundleProblem& problem) {
  std::vector<double> shares(problem.bundle.world_from_body.size(), 0);
  for (const BundleObservation& seen : problem.bundle.observations) {
    if (seen.camera == 0) shares[static_cast<std::size_t>(seen.pose)] += 1;
  }
  for (const InertialLink& link : problem.links) shares[static_cast<std::size_t>(link.from)] += 1;
  return shares;
}

Ties ties_of(const Map& map, const InertialMapProblem& problem) {
  const auto& keyframes = problem.map.keyframes;
  const std::vector<double> shares = shares_of(problem.inertial);
  Ties ties;
  double sum = 0;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const Keyframe* keyframe = map.find(keyframes[i]);
    if (!problem.inertial.bundle.pose_fixed[i] || !keyframe || !keyframe->covariance) continue;
    ties.drift += shares[i] * keyframe->covariance->drift;
    ties.anchor += shares[i] * seconds_between(map.begin(), keyframe->frame.time);
    sum += shares[i];
  }
  if (sum == 0) return {};
  return {ties.drift / sum, ties.anchor / sum};
}

std::size_t newest_free(const InertialMapProblem& problem) {
  const auto& fixed = problem.inertial.bundle.pose_fixed;
  std::size_t newest = 0;
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    const bool later = problem.map.keyframes[newest] < problem.map.keyframes[i];
    if (!fixed[i] && later) newest = i;
  }
  return newest;
}

void keep_newest(Map& map, const InertialMapProblem& problem, const Matrix15d& covariance) {
  const Keyframe* newest = map.find(problem.map.keyframes[newest_free(problem)]);
  if (!newest) return;
  Ties ties = ties_of(map, problem);
  Eigen::Matrix4d drift =
      ties.drift + drift_of(newest->world_from_body(), covariance.topLeftCorner<6, 6>());
  const Keyframe* previous = map.find(newest->previous);
  if (previous && previous->covariance && ties.anchor > previous->covariance->anchor - kRevisit) {
    ties.anchor = std::max(ties.anchor, previous->covariance->anchor);
    drift = at_least(previous->covariance->drift, drift);
  }
  map.set_covariance(newest->id, std::make_shared<const StateCovariance>(
                                     StateCovariance{covariance, drift, ties.anchor}));
}

}  // namespace

void keep_covariances(Map& map, const InertialMapProblem& problem,
                      const InertialBundleSummary& summary) {
  for (std::size_t i = 0; i < summary.covariance.size(); ++i) {
    const Matrix15d& covariance = summary.covariance[i];
    const Eigen::Matrix4d drift =
        drift_of(problem.inertial.bundle.world_from_body[i], covariance.topLeftCorner<6, 6>());
    map.set_covariance(problem.map.keyframes[i], std::make_shared<const StateCovariance>(
                                                     StateCovariance{covariance, drift, 0}));
  }
  if (summary.state_covariance) keep_newest(map, problem, *summary.state_covariance);
}

}  // namespace rover
