#include "rover/optimization/state_covariance.h"

#include <algorithm>

#include "rover/optimization/drift.h"
#include "rover/optimization/map_error.h"

namespace rover {
namespace {

// Of a similarity.
constexpr int kPositionAndYaw[] = {0, 1, 2, 5};

// What the fixed states of a window have drifted in the mean, and how old they are.
struct Ties {
  Matrix7d drift = Matrix7d::Zero();
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

using Matrix7x3d = Eigen::Matrix<double, 7, 3>;
using Matrix3x7d = Eigen::Matrix<double, 3, 7>;
using Matrix9x7d = Eigen::Matrix<double, 9, 7>;

// Given the drift of what the window held fixed.
StateCovariance in_window(const InertialState& state, const InertialBundleSummary& summary,
                          const Ties& ties) {
  StateCovariance known;
  known.mean = state;
  known.given_map = *summary.state_covariance;
  known.response = summary.state_response + upright(state);
  known.map_error = map_error_of(ties.drift);
  const Matrix7d by_pose = similarity_by_pose(state.world_from_body);
  Matrix7d own = Matrix7d::Zero();
  own.topLeftCorner<6, 6>() = known.given_map.topLeftCorner<6, 6>();
  const Matrix7x3d response = by_pose.leftCols<6>() * summary.state_response.topRows<6>();
  Matrix7d handed = Matrix7d::Identity();
  for (int k = 0; k < 3; ++k) handed.col(k == 2 ? 6 : 3 + k) += response.col(k);
  known.drift = by_pose * own * by_pose.transpose() + handed * ties.drift * handed.transpose();
  known.anchor = ties.anchor;
  return known;
}

// The covariance of what is known to one and, independently, by information.
Matrix6d both(const Matrix6d& covariance, const Matrix6d& information) {
  const Matrix6d product = Matrix6d::Identity() + information * covariance;
  const Matrix6d result = product.transpose().partialPivLu().solve(covariance);
  return 0.5 * (result + result.transpose());
}

// Of a state where nothing was fixed: how its pose and the map's scale are known, and the rest with
// them. Stereo has no scale to err by.
struct Free {
  Matrix7d own = Matrix7d::Zero();
  Matrix9x7d rest_with_own;
  Matrix9d rest;
};

Free free_of(const InertialBundleSummary& summary, std::size_t pose, const Matrix15d& covariance,
             bool is_metric) {
  const Vector15d with_scale = is_metric ? Vector15d::Zero() : summary.with_scale[pose];
  const double scale_sigma = is_metric ? 0 : summary.scale_sigma;
  Free free;
  free.own.topLeftCorner<6, 6>() = covariance.topLeftCorner<6, 6>();
  free.own.topRightCorner<6, 1>() = with_scale.head<6>();
  free.own.bottomLeftCorner<1, 6>() = with_scale.head<6>().transpose();
  free.own(6, 6) = std::max(scale_sigma * scale_sigma, 1e-12);
  free.rest_with_own << covariance.bottomLeftCorner<9, 6>(), with_scale.tail<9>();
  free.rest = covariance.bottomRightCorner<9, 9>();
  return free;
}

// A state's tilt and the scale by its pose and the scale.
Matrix3x7d error_by_own(const InertialState& state) {
  Matrix3x7d by_own = Matrix3x7d::Zero();
  by_own.block<2, 3>(0, 3) = state.world_from_body.rotation_matrix().topRows<2>();
  by_own(2, 6) = 1;
  return by_own;
}

// How velocity and biases move as the state turns about the vertical: by the map's own turn, which
// nobody knows, they are not wrong.
Matrix9x7d rest_by_turn(const InertialState& state) {
  Matrix9x7d by_own = Matrix9x7d::Zero();
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  by_own.block<3, 3>(0, 3) =
      up.cross(state.velocity) * up.transpose() * state.world_from_body.rotation_matrix();
  return by_own;
}

// Where nothing was fixed, a state's own tilt and the scale are the map's error; velocity and
// biases err with these as regression says, and by the rest. All of it is kept: regression on what
// is not told on, the way since the map began, would take away what velocity and scale have in
// common with it. `seen` is what tells the pose from the map.
StateCovariance by_itself(const InertialState& state, const Free& free, const Matrix6d& seen) {
  const Matrix9x7d by_turn = rest_by_turn(state);
  const Matrix3x7d error = error_by_own(state);
  const Matrix9x7d with_own = free.rest_with_own - by_turn * free.own;
  const Matrix9d turned = free.rest_with_own * by_turn.transpose();
  const Matrix9d rest =
      free.rest - turned - turned.transpose() + by_turn * free.own * by_turn.transpose();
  const Eigen::Matrix3d tilt_and_scale = error * free.own * error.transpose();
  const Eigen::Matrix<double, 9, 3> by_error =
      tilt_and_scale.ldlt().solve(error * with_own.transpose()).transpose();
  const Matrix6d in_map = both(free.own.topLeftCorner<6, 6>(), seen);
  Eigen::Matrix<double, 15, 6> by_pose;
  by_pose << Matrix6d::Identity(), (by_error * error + by_turn).leftCols<6>();
  StateCovariance known;
  known.mean = state;
  known.given_map = by_pose * in_map * by_pose.transpose();
  known.given_map.bottomRightCorner<9, 9>() +=
      rest - by_error * tilt_and_scale * by_error.transpose();
  known.response = upright(state);
  known.response.bottomRows<9>() = by_error;
  const Matrix7d similarity = similarity_by_pose(state.world_from_body);
  known.drift = similarity * free.own * similarity.transpose();
  Matrix7d around = free.own;
  around.topLeftCorner<6, 6>() -= in_map;
  known.map_error = map_error_of(similarity * around * similarity.transpose());
  return known;
}

StateCovariance by_itself(const InertialMapProblem& problem, const InertialBundleSummary& summary,
                          std::size_t pose, const Matrix15d& covariance) {
  const bool is_metric = problem.inertial.bundle.rig.size() > 1;
  return by_itself(problem.inertial.state(static_cast<int>(pose)),
                   free_of(summary, pose, covariance, is_metric), summary.seen[pose]);
}

// Position and yaw drift no less than the keyframe before would have in this place. (In its own
// place a tilted map of a wrong scale is off by something else, with nothing learned or forgotten.)
void keep_drift(const StateCovariance& previous, StateCovariance& known) {
  if (is_revisit(known.anchor, previous.anchor)) return;
  known.anchor = std::max(known.anchor, previous.anchor);
  const Eigen::Vector3d& here = known.mean.world_from_body.translation;
  const Eigen::Matrix4d drift = drift_at(here, known.drift);
  const Eigen::Matrix4d more = at_least(drift, drift_at(here, previous.drift)) - drift;
  known.drift(kPositionAndYaw, kPositionAndYaw) += more;
}

void set(Map& map, KeyframeId id, const StateCovariance& known) {
  map.set_covariance(id, std::make_shared<const StateCovariance>(known));
}

void keep_newest(Map& map, const InertialMapProblem& problem,
                 const InertialBundleSummary& summary) {
  const std::size_t pose = newest_free(problem);
  const Keyframe* newest = map.find(problem.map.keyframes[pose]);
  if (!newest) return;
  if (is_free(problem) && summary.with_scale.empty()) return;
  StateCovariance known = is_free(problem)
                              ? by_itself(problem, summary, pose, *summary.state_covariance)
                              : in_window(problem.inertial.state(static_cast<int>(pose)), summary,
                                          ties_of(map, problem));
  const Keyframe* previous = map.find(newest->previous);
  if (previous && previous->covariance) keep_drift(*previous->covariance, known);
  set(map, newest->id, known);
}

// What the first of the states, which held position and yaw of the others, had drifted before.
Matrix7d drift_before(const Map& map, const InertialMapProblem& problem) {
  Matrix7d before = Matrix7d::Zero();
  const Keyframe* first = map.find(problem.map.keyframes.front());
  if (!first || !first->previous.valid() || !first->covariance) return before;
  before(kPositionAndYaw, kPositionAndYaw) =
      first->covariance->drift(kPositionAndYaw, kPositionAndYaw);
  return before;
}

void keep_all(Map& map, const InertialMapProblem& problem, const InertialBundleSummary& summary,
              double scale) {
  const Matrix7d before = drift_before(map, problem);
  for (std::size_t i = 0; i < summary.covariance.size(); ++i) {
    const Keyframe* keyframe = map.find(problem.map.keyframes[i]);
    if (!keyframe) continue;
    StateCovariance now = by_itself(problem, summary, i, summary.covariance[i]);
    now.drift += before;
    const bool is_newest = i == newest_free(problem);
    StateCovariance known = keyframe->covariance && !is_newest ? *keyframe->covariance : now;
    if (keyframe->covariance && !is_newest) known.mean.velocity *= scale;
    known.drift = now.drift;
    known.anchor = 0;
    set(map, keyframe->id, known);
  }
}

}  // namespace

bool is_revisit(double anchor, double before) {
  constexpr double kOlder = 2;  // s: ties wander by less as keyframes are culled
  return anchor <= before - kOlder;
}

void keep_covariances(Map& map, const InertialMapProblem& problem,
                      const InertialBundleSummary& summary, double scale) {
  if (is_free(problem) && !summary.with_scale.empty()) keep_all(map, problem, summary, scale);
  if (summary.state_covariance) keep_newest(map, problem, summary);
}

// In the covariance's tangent. Position and yaw are the map's own; the pose has been adjusted
// since, and the velocity has turned with it.
std::optional<StatePrior> prior_of(const Keyframe& keyframe) {
  if (!keyframe.covariance) return std::nullopt;
  const StateCovariance& known = *keyframe.covariance;
  StatePrior prior;
  prior.mean = known.mean;
  const Eigen::Quaterniond since =
      keyframe.world_from_body().rotation * known.mean.world_from_body.rotation.conjugate();
  const Eigen::Quaterniond yaw = so3_exp({0, 0, so3_log(since).z()});
  prior.mean.world_from_body.rotation = yaw * known.mean.world_from_body.rotation;
  prior.mean.world_from_body.translation = keyframe.world_from_body().translation;
  prior.mean.velocity = yaw * known.mean.velocity;
  Eigen::Matrix<double, 11, 15> picked = Eigen::Matrix<double, 11, 15>::Zero();
  picked.block<2, 3>(0, 3) = known.mean.world_from_body.rotation_matrix().topRows<2>();
  picked.bottomRightCorner<9, 9>().setIdentity();
  const Eigen::MatrixXd information = inverse_of(picked * known.covariance() * picked.transpose());
  if (information.rows() == 0) return std::nullopt;
  prior.information = picked.transpose() * information * picked;
  return prior;
}

}  // namespace rover
