#pragma once

#include <utility>
#include <vector>

#include "rover/imu/imu_noise.h"
#include "rover/imu/inertial_state.h"

namespace rover {

using Matrix96d = Eigen::Matrix<double, 9, 6>;

// The motion over an interval as the inertial sensor alone tells it: in the body frame at the
// interval's begin, falling freely with it.
struct InertialDelta {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();            // m
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // begin_from_end
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();            // m/s
};

// On-manifold preintegration: Forster, Carlone, Dellaert, Scaramuzza, "On-manifold preintegration
// for real-time visual-inertial odometry" (2017). Between samples the angular velocity is the mean
// of both and the acceleration goes on a line between both, each turned to the begin. Errors are
// ordered (position, rotation, velocity); that of the rotation is on the right. The samples are
// kept, so that a bias far from the one integrated with costs a new integration, not accuracy.
class Preintegration {
 public:
  // The samples of ImuBuffer::between: at least two, in order. Throws std::invalid_argument.
  Preintegration(std::vector<ImuSample> samples, const ImuBias& bias, const ImuNoise& noise);

  // One interval and the one that follows it as one, with the bias of the first: for keyframes that
  // are culled. Throws std::invalid_argument where the second does not begin where the first ends.
  static Preintegration merged(const Preintegration& first, const Preintegration& second);

  // The same sensor with the same bias over other samples.
  Preintegration over(std::vector<ImuSample> samples) const {
    return {std::move(samples), bias_, noise_};
  }

  Timestamp begin() const { return samples_.front().time; }
  Timestamp end() const { return samples_.back().time; }
  double duration() const { return duration_; }  // s
  double longest_step() const;                   // s between samples: large where they are missing
  const std::vector<ImuSample>& samples() const { return samples_; }
  const ImuBias& bias() const { return bias_; }  // integrated with

  // The motion for another bias, to first order in its difference.
  InertialDelta corrected(const ImuBias& bias) const;

  // Whether the first order is no longer good enough; and integration with another bias.
  bool is_far(const ImuBias& bias) const;
  void reintegrate(const ImuBias& bias);

  const InertialDelta& delta() const { return delta_; }
  const Matrix9d& covariance() const { return covariance_; }
  const Matrix96d& by_bias() const { return by_bias_; }  // d delta / d (gyroscope, accelerometer)
  // Lower triangular W with W^T W = the inverse covariance of 15 errors: the 9, and how the biases
  // have walked meanwhile, which moves the 9 as well. Its first 9 rows are the whitening of the 9
  // alone.
  const Matrix15d& whitening() const { return whitening_; }
  Vector6d walk_sigma() const;  // standard deviation of the bias' change over the interval

  // Where the motion takes a state; gravity in its world, m/s^2. The bias stays.
  InertialState predict(const InertialState& from, const Eigen::Vector3d& gravity) const;

 private:
  void integrate();
  void step(const ImuSample& a, const ImuSample& b);
  void propagate(const Matrix9d& transition, const Matrix96d& by_reading, double elapsed,
                 double dt);
  void whiten();

  std::vector<ImuSample> samples_;
  ImuBias bias_;
  ImuNoise noise_;
  double duration_ = 0;
  InertialDelta delta_;
  Matrix9d covariance_;
  Matrix96d with_walk_;  // covariance of the 9 errors with the walk of the biases
  Matrix96d by_bias_;
  Matrix15d whitening_;
};

}  // namespace rover
