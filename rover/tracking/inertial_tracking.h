#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "rover/imu/imu_buffer.h"
#include "rover/map/map.h"
#include "rover/optimization/inertial_pose_optimization.h"
#include "rover/optimization/inertial_smoothing.h"

namespace rover {

// How well a velocity is known that nothing tells, m/s.
constexpr double kUnknownVelocity = 2;

struct InertialTrackingOptions {
  ImuNoiseOptions noise;
  InertialPoseOptions pose;
  // How well the state of a keyframe is known of which mapping does not tell, given the map.
  double position_sigma = 0.003;           // m
  double rotation_sigma = 0.001;           // rad
  double velocity_sigma = 0.02;            // m/s
  double gyroscope_bias_sigma = 0.001;     // rad/s
  double accelerometer_bias_sigma = 0.02;  // m/s^2
  int min_inliers = 5;  // with a state, so few landmarks in the local map confirm a pose
  // Vision and inertial data that disagree by more (chi-square of 24 degrees of freedom) do so as
  // the map does not fit together here (old landmarks come back into view): the body has not moved,
  // its place in the map has, by so much.
  double max_tension = 50;
  double slip_position_sigma = 0.05;  // m
  double slip_yaw_sigma = 0.01;       // rad
  double min_gap = 0.25;              // s without vision that are reported, and after which other
                                      // places than the last one are looked at
  double max_dead_reckoning = 5;      // s without vision that inertial data bridge
  double max_interval = 60;           // s between keyframes over which motion is integrated at all

  void check() const;
};

struct StampedState {
  Timestamp time = 0;
  InertialState state;
};

// The state of the body from frame to frame, in the frame of an aligned map: predicted by
// integration, then estimated with what the frame sees. The marginal of one frame is the prior of
// the next; where mapping has adjusted the newest keyframe, its state is the prior instead.
class InertialTracking {
 public:
  InertialTracking(const ImuCalibration& calibration, const InertialTrackingOptions& options);

  // False: the sample is out of order or not finite, and left out.
  bool add(ImuSample sample) {
    sample.time -= time_offset_;
    return imu_.add(sample);
  }
  // What is taken from the stamps of the samples from now on, ns; those that are there follow.
  void set_time_offset(Timestamp offset);
  Timestamp time_offset() const { return time_offset_; }
  // The samples from a moment on.
  std::vector<ImuSample> samples_after(Timestamp time) const;

  // The motion of the body over an interval; null where the samples do not cover it.
  std::shared_ptr<const Preintegration> motion(Timestamp from, Timestamp to,
                                               const ImuBias& bias) const;

  // Looks at the map as it is when a frame comes: forgets the state where the map is not aligned,
  // and takes the newest keyframe's where that has changed. `usable`: tracking has not been lost.
  void follow(const Map& map);
  // Integrates from the last state to a frame. Nothing where the state or the data are missing.
  std::optional<SE3> predict(Timestamp time);
  // The state of the frame predicted, with what it sees (nothing: dead reckoning).
  PoseEstimate estimate(const Rig& rig, std::span<const PoseObservation> observations);
  // The next estimates are of a body that stands still, up to `sigma` m/s.
  void hold_still(double sigma) { still_sigma_ = sigma; }
  void release() { still_sigma_.reset(); }
  // The last estimate is right: it is where the next prediction starts. `seen`: with vision, else
  // it is dead reckoning.
  void accept(bool seen = true);
  // A pose was found without a state: the velocity (world, m/s) is known to `sigma` only.
  void restart(Timestamp time, const SE3& world_from_body, const Eigen::Vector3d& velocity,
               double sigma);
  void forget() { last_.reset(), before_.reset(), motion_.reset(), reckoned_.clear(); }
  // Drops samples that no later call will ask for.
  void forget_before(Timestamp time) { imu_.forget_before(time - kLongestShift); }

  bool has_prediction() const { return motion_ != nullptr; }
  // The samples from the last state to the frame predicted; none without a prediction.
  std::span<const ImuSample> samples() const;
  // After accept() ended dead reckoning: the states in between as they look from its end, in order.
  const std::vector<StampedState>& smoothed() const { return smoothed_; }
  // How the body has moved from `time` to the last accepted frame, as inertial data and that frame
  // together tell: what they move both ends by is left out. Nothing where that is not known.
  std::optional<SE3> motion_since(Timestamp time) const;
  // Of the last accepted frame; nothing where there is no state.
  std::optional<InertialState> state() const;
  // Given position and yaw of the map.
  Matrix15d covariance() const;
  // The last state's covariance with what drift the map has around it, for a keyframe made of it.
  std::shared_ptr<const StateCovariance> knowledge() const;
  // How far the map around it has drifted in position and yaw: no less than was stated before,
  // unless the map's epoch has changed or a place is seen again.
  const Eigen::Matrix4d& drift() const { return stated_drift_; }
  const ImuBias& bias() const { return bias_; }
  const InertialTrackingOptions& options() const { return options_; }

 private:
  // ns that a new offset of the clock may move samples by without any missing.
  static constexpr Timestamp kLongestShift = 200'000'000;

  struct Known {
    Timestamp time = 0;
    InertialState state;
    Matrix15d information;                       // given the map
    Matrix15x3d response = Matrix15x3d::Zero();  // how it errs with the map, in its frame
  };
  Matrix15d usual_information() const;
  Matrix15d information_of(const Keyframe& keyframe) const;
  Matrix15x3d upright_response() const;
  Matrix15d slipped_information() const;
  void state_drift(const StateCovariance& known);
  void smooth();

  InertialTrackingOptions options_;
  ImuNoise noise_;
  ImuBuffer imu_;
  Timestamp time_offset_ = 0;
  std::optional<Known> last_;
  std::optional<StampedState> before_;  // what last_ was estimated from, as it looked then
  KeyframeId keyframe_;                 // the newest one and its state when it was looked at
  InertialState keyframe_state_;
  int epoch_ = -1;
  MapId map_;
  ImuBias bias_;  // of the newest keyframe
  // What the newest keyframe tells of the map around it.
  Matrix63d seen_response_ = Matrix63d::Zero();
  Eigen::Matrix3d map_error_ = Eigen::Matrix3d::Zero();
  Matrix7d drift_ = Matrix7d::Zero();
  Eigen::Matrix4d stated_drift_ = Eigen::Matrix4d::Zero();
  bool restates_drift_ = true;  // the map has changed since
  double anchor_ = 0;
  std::shared_ptr<const Preintegration> motion_;  // from the last state to the frame predicted
  InertialPoseEstimate current_;
  std::optional<double> still_sigma_;
  std::vector<ReckonedStep> reckoned_;  // since vision last confirmed a state
  std::vector<StampedState> smoothed_;
};

}  // namespace rover
