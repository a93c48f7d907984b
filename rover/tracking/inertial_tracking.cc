#include "rover/tracking/inertial_tracking.h"

#include <algorithm>
#include <utility>

#include "rover/base/error.h"
#include "rover/optimization/drift.h"
#include "rover/optimization/map_error.h"
#include "rover/optimization/state_covariance.h"

namespace rover {
namespace {

Matrix15d diagonal_information(double position, double rotation, double velocity, double gyroscope,
                               double accelerometer) {
  Vector15d sigma;
  sigma << Eigen::Vector3d::Constant(position), Eigen::Vector3d::Constant(rotation),
      Eigen::Vector3d::Constant(velocity), Eigen::Vector3d::Constant(gyroscope),
      Eigen::Vector3d::Constant(accelerometer);
  return sigma.cwiseAbs2().cwiseInverse().asDiagonal();
}

void set_velocity_sigma(double sigma, Matrix15d& information) {
  information.block<3, 3>(6, 6) = Eigen::Matrix3d::Identity() / (sigma * sigma);
}

bool same(const InertialState& a, const InertialState& b) {
  return state_minus(a, b).isZero(1e-12);
}

}  // namespace

void InertialTrackingOptions::check() const {
  noise.check();
  pose.check();
  require(position_sigma > 0 && rotation_sigma > 0 && velocity_sigma > 0 &&
              gyroscope_bias_sigma > 0 && accelerometer_bias_sigma > 0,
          "inertial: the standard deviations of a keyframe's state must be positive");
  require(min_gap > 0, "inertial.min_gap is {}; use a positive number of seconds", min_gap);
  require(max_dead_reckoning >= 0, "inertial.max_dead_reckoning is {}; use 0 s or more",
          max_dead_reckoning);
  require(min_inliers >= 4, "inertial.min_inliers is {}; use 4 or more", min_inliers);
  require(max_tension > 0, "inertial.max_tension is {}; use a positive number", max_tension);
  require(slip_position_sigma > 0 && slip_yaw_sigma > 0,
          "inertial.slip_position_sigma and slip_yaw_sigma must be positive");
  require(max_interval > 0, "inertial.max_interval is {}; use a positive number", max_interval);
}

InertialTracking::InertialTracking(const ImuCalibration& calibration,
                                   const InertialTrackingOptions& options)
    : options_(options), noise_(ImuNoise::of(calibration, options.noise)) {
  options_.check();
}

void InertialTracking::set_time_offset(Timestamp offset) {
  if (offset == time_offset_) return;
  imu_.shift(time_offset_ - offset);
  time_offset_ = offset;
}

std::vector<ImuSample> InertialTracking::samples_after(Timestamp time) const {
  const auto& samples = imu_.samples();
  const auto first = std::ranges::lower_bound(samples, time, {}, &ImuSample::time);
  return {first, samples.end()};
}

std::shared_ptr<const Preintegration> InertialTracking::motion(Timestamp from, Timestamp to,
                                                               const ImuBias& bias) const {
  if (to <= from || seconds_between(from, to) > options_.max_interval) return nullptr;
  auto samples = imu_.between(from, to);
  if (samples.size() < 2) return nullptr;
  return std::make_shared<const Preintegration>(std::move(samples), bias, noise_);
}

Matrix15d InertialTracking::usual_information() const {
  return diagonal_information(options_.position_sigma, options_.rotation_sigma,
                              options_.velocity_sigma, options_.gyroscope_bias_sigma,
                              options_.accelerometer_bias_sigma);
}

Matrix15d InertialTracking::information_of(const Keyframe& keyframe) const {
  Matrix15d usual = usual_information();
  if (!keyframe.motion) set_velocity_sigma(kUnknownVelocity, usual);
  if (!keyframe.covariance) return usual;
  const Eigen::MatrixXd information = inverse_of(keyframe.covariance->given_map);
  return information.rows() == 0 ? usual : Matrix15d(information);
}

void InertialTracking::follow(const Map& map) {
  motion_.reset();
  if (!map.inertial().aligned) {
    last_.reset();
    keyframe_ = {};
    return;
  }
  const Keyframe& newest = map.at(map.newest_keyframe());
  const InertialState state = newest.state();
  const bool announced = map.id() != map_ || map.epoch() != epoch_;
  if (!announced && newest.id == keyframe_ && same(state, keyframe_state_)) return;
  restates_drift_ |= announced;
  map_ = map.id();
  epoch_ = map.epoch();
  keyframe_ = newest.id;
  keyframe_state_ = state;
  bias_ = state.bias;
  last_ = {newest.frame.time, state, information_of(newest)};
  reckoned_.clear();
  if (!newest.covariance) return;
  const StateCovariance& known = *newest.covariance;
  last_->response = known.response - upright(known.mean);
  seen_response_ = last_->response.topRows<6>();
  map_error_ = known.map_error;
  state_drift(known);
  drift_ = known.drift;
  anchor_ = known.anchor;
}

// What a tilted map is off by may also shrink as the body flies back to where the map began: what
// is stated does not.
void InertialTracking::state_drift(const StateCovariance& known) {
  const Eigen::Matrix4d now = drift_at(known.mean.world_from_body.translation, known.drift);
  const bool anew = std::exchange(restates_drift_, false) || is_revisit(known.anchor, anchor_);
  stated_drift_ = anew ? now : at_least(now, stated_drift_);
}

std::optional<SE3> InertialTracking::predict(Timestamp time) {
  if (!last_) return std::nullopt;
  motion_ = motion(last_->time, time, last_->state.bias);
  if (!motion_) return std::nullopt;
  return motion_->predict(last_->state, gravity_of_z_up()).world_from_body;
}

PoseEstimate InertialTracking::estimate(const Rig& rig,
                                        std::span<const PoseObservation> observations) {
  InertialPoseProblem problem{rig, *motion_, last_->state, last_->information, observations};
  problem.last_response = last_->response;
  problem.seen_response = seen_response_;
  if (still_sigma_) problem.current_prior = zero_velocity_prior(*still_sigma_);
  current_ = optimize_inertial_pose(problem, options_.pose);
  if (current_.imu_chi2 + current_.prior_chi2 > options_.max_tension) {
    problem.last_information = slipped_information();
    current_ = optimize_inertial_pose(problem, options_.pose);
  }
  PoseEstimate pose;
  pose.world_from_body = current_.current.world_from_body;
  pose.covariance = current_.covariance.topLeftCorner<6, 6>();
  pose.inliers = current_.inliers;
  pose.inlier_count = current_.inlier_count;
  pose.mean_chi2 = current_.mean_chi2;
  pose.converged = current_.converged;
  return pose;
}

// Of the last state, if the map around the body is not the one that it was known in: displaced and
// turned about gravity. Velocity, tilt and biases do not depend on the map.
Matrix15d InertialTracking::slipped_information() const {
  Eigen::MatrixXd covariance = inverse_of(last_->information);
  if (covariance.rows() == 0) return last_->information;
  const Eigen::Vector3d vertical =
      last_->state.world_from_body.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  covariance.diagonal().head<3>().array() +=
      options_.slip_position_sigma * options_.slip_position_sigma;
  covariance.block<3, 3>(3, 3) +=
      options_.slip_yaw_sigma * options_.slip_yaw_sigma * vertical * vertical.transpose();
  const Eigen::MatrixXd information = inverse_of(covariance);
  return information.rows() == 0 ? last_->information : Matrix15d(information);
}

void InertialTracking::accept(bool seen) {
  smoothed_.clear();
  if (!motion_ || !current_.converged) return;
  if (!seen || !reckoned_.empty()) {
    reckoned_.push_back({last_->state, last_->information, motion_});
  }
  before_ = {last_->time, current_.last};
  last_ = {motion_->end(), current_.current, current_.information, current_.response};
  if (seen && !reckoned_.empty()) smooth();
}

void InertialTracking::smooth() {
  const auto states = smooth_reckoning(reckoned_, last_->state);
  for (std::size_t i = 1; i < states.size(); ++i) {  // the first was seen
    smoothed_.push_back({reckoned_[i].motion->begin(), states[i]});
  }
  reckoned_.clear();
}

void InertialTracking::restart(Timestamp time, const SE3& world_from_body,
                               const Eigen::Vector3d& velocity, double sigma) {
  last_ = {time, {world_from_body, velocity, bias_}, usual_information()};
  set_velocity_sigma(sigma, last_->information);
  before_.reset();
  reckoned_.clear();
  smoothed_.clear();
}

std::span<const ImuSample> InertialTracking::samples() const {
  if (!motion_) return {};
  return motion_->samples();
}

std::optional<SE3> InertialTracking::motion_since(Timestamp time) const {
  if (!before_ || !last_ || time < before_->time) return std::nullopt;
  SE3 begin = before_->state.world_from_body;
  if (time > before_->time) {
    const auto way = motion(before_->time, time, before_->state.bias);
    if (!way) return std::nullopt;
    begin = way->predict(before_->state, gravity_of_z_up()).world_from_body;
  }
  return begin.inverse() * last_->state.world_from_body;
}

std::optional<InertialState> InertialTracking::state() const {
  if (!last_) return std::nullopt;
  return last_->state;
}

Matrix15x3d InertialTracking::upright_response() const {
  return current_.response + upright(current_.current);
}

Matrix15d InertialTracking::covariance() const {
  const Matrix15x3d response = upright_response();
  return current_.covariance + response * map_error_ * response.transpose();
}

std::shared_ptr<const StateCovariance> InertialTracking::knowledge() const {
  if (!last_) return nullptr;
  const Eigen::MatrixXd covariance = inverse_of(last_->information);
  if (covariance.rows() == 0) return nullptr;
  return std::make_shared<const StateCovariance>(
      StateCovariance{last_->state, covariance, last_->response + upright(last_->state), map_error_,
                      drift_, anchor_});
}

}  // namespace rover
