#include "rover/imu/preintegration.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <Eigen/Cholesky>

namespace rover {
namespace {

// Beyond these the second order of the correction is a tenth of the noise of half a second.
constexpr double kFarGyroscope = 0.01;     // rad/s
constexpr double kFarAccelerometer = 0.2;  // m/s^2

// One step of the mean acceleration: its parts of velocity and position, and their Jacobians by
// the rotation at begin and by the biases.
struct Step {
  Eigen::Quaterniond turn;  // begin_from_end of the step
  Eigen::Matrix3d by_rate;  // right Jacobian of the turn, times dt
  Eigen::Vector3d force_a;  // specific force at both ends, each in its own body frame
  Eigen::Vector3d force_b;
};

Step make_step(const ImuSample& a, const ImuSample& b, const ImuBias& bias, double dt) {
  const Eigen::Vector3d angle =
      dt * (0.5 * (a.angular_velocity + b.angular_velocity) - bias.gyroscope);
  return {so3_exp(angle), dt * so3_right_jacobian(angle), a.acceleration - bias.accelerometer,
          b.acceleration - bias.accelerometer};
}

}  // namespace

Preintegration::Preintegration(std::vector<ImuSample> samples, const ImuBias& bias,
                               const ImuNoise& noise)
    : samples_(std::move(samples)), bias_(bias), noise_(noise) {
  if (samples_.size() < 2) throw std::invalid_argument("preintegration: fewer than two samples");
  for (std::size_t i = 1; i < samples_.size(); ++i) {
    if (samples_[i].time <= samples_[i - 1].time)
      throw std::invalid_argument("preintegration: samples are not in order of time");
  }
  integrate();
}

Preintegration Preintegration::merged(const Preintegration& first, const Preintegration& second) {
  if (first.end() != second.begin())
    throw std::invalid_argument("preintegration: merged intervals do not join");
  std::vector<ImuSample> samples = first.samples_;
  samples.insert(samples.end(), second.samples_.begin() + 1, second.samples_.end());
  return Preintegration(std::move(samples), first.bias_, first.noise_);
}

double Preintegration::longest_step() const {
  Timestamp longest = 0;
  for (std::size_t i = 1; i < samples_.size(); ++i)
    longest = std::max(longest, samples_[i].time - samples_[i - 1].time);
  return seconds_between(0, longest);
}

void Preintegration::integrate() {
  duration_ = seconds_between(begin(), end());
  delta_ = {};
  covariance_.setZero();
  with_walk_.setZero();
  by_bias_.setZero();
  for (std::size_t i = 1; i < samples_.size(); ++i) step(samples_[i - 1], samples_[i]);
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
  // A single short step leaves the position's own noise at rounding level: kept above it.
  covariance_.diagonal().head<3>().array() += 1e-14;
  whiten();
}

void Preintegration::whiten() {
  Matrix15d joint;
  joint.topLeftCorner<9, 9>() = covariance_;
  joint.topRightCorner<9, 6>() = with_walk_;
  joint.bottomLeftCorner<6, 9>() = with_walk_.transpose();
  joint.bottomRightCorner<6, 6>() = walk_sigma().cwiseAbs2().asDiagonal();
  whitening_ = joint.llt().matrixL().solve(Matrix15d::Identity());
}

// Forster et al., equation 62 ff., for forces taken at both ends.
void Preintegration::step(const ImuSample& a, const ImuSample& b) {
  const double dt = seconds_between(a.time, b.time);
  const Step step = make_step(a, b, bias_, dt);
  const Eigen::Matrix3d begin = delta_.rotation.toRotationMatrix();
  const Eigen::Matrix3d turn = step.turn.toRotationMatrix();
  const Eigen::Matrix3d end = begin * turn;
  const Eigen::Vector3d force_a = begin * step.force_a, force_b = end * step.force_b;

  // By the rotation error at begin, and by the error of the angular velocity.
  const Eigen::Matrix3d a_by_rotation = -begin * skew(step.force_a);
  const Eigen::Matrix3d b_by_end = -end * skew(step.force_b);
  const Eigen::Matrix3d b_by_rotation = b_by_end * turn.transpose();
  const Eigen::Matrix3d b_by_rate = b_by_end * step.by_rate;
  const Eigen::Matrix3d eye = Eigen::Matrix3d::Identity();

  Matrix9d transition = Matrix9d::Identity();
  transition.block<3, 3>(0, 3) = dt * dt * (a_by_rotation / 3 + b_by_rotation / 6);
  transition.block<3, 3>(0, 6) = dt * eye;
  transition.block<3, 3>(3, 3) = turn.transpose();
  transition.block<3, 3>(6, 3) = dt / 2 * (a_by_rotation + b_by_rotation);
  Matrix96d by_reading = Matrix96d::Zero();
  by_reading.block<3, 3>(0, 0) = dt * dt / 6 * b_by_rate;
  by_reading.block<3, 3>(3, 0) = step.by_rate;
  by_reading.block<3, 3>(6, 0) = dt / 2 * b_by_rate;
  by_reading.block<3, 3>(0, 3) = dt * dt * (begin / 3 + end / 6);
  by_reading.block<3, 3>(6, 3) = dt / 2 * (begin + end);

  propagate(transition, by_reading, seconds_between(samples_.front().time, a.time), dt);
  by_bias_ = (transition * by_bias_ - by_reading).eval();
  delta_.position += dt * delta_.velocity + dt * dt * (force_a / 3 + force_b / 6);
  delta_.velocity += dt / 2 * (force_a + force_b);
  delta_.rotation = (delta_.rotation * step.turn).normalized();
}

// The error of a step e' = A e - B (n + b): readings err by their noise n and by what the biases
// have walked since the begin, b, which goes on into the next step.
void Preintegration::propagate(const Matrix9d& transition, const Matrix96d& by_reading,
                               double elapsed, double dt) {
  Vector6d walked, noise;
  walked.head<3>().setConstant(noise_.gyroscope_walk * noise_.gyroscope_walk * elapsed);
  walked.tail<3>().setConstant(noise_.accelerometer_walk * noise_.accelerometer_walk * elapsed);
  noise.head<3>().setConstant(noise_.gyroscope_variance(dt));
  noise.tail<3>().setConstant(noise_.accelerometer_variance(dt));
  const Matrix96d moved = transition * with_walk_;
  const Matrix9d mixed = moved * by_reading.transpose();
  covariance_ = (transition * covariance_ * transition.transpose() - mixed - mixed.transpose() +
                 by_reading * (noise + walked).asDiagonal() * by_reading.transpose())
                    .eval();
  with_walk_ = moved - by_reading * walked.asDiagonal();
}

InertialDelta Preintegration::corrected(const ImuBias& bias) const {
  const Vector9d change = by_bias_ * (bias.vector() - bias_.vector());
  return {delta_.position + change.head<3>(),
          (delta_.rotation * so3_exp(change.segment<3>(3))).normalized(),
          delta_.velocity + change.tail<3>()};
}

bool Preintegration::is_far(const ImuBias& bias) const {
  return (bias.gyroscope - bias_.gyroscope).norm() > kFarGyroscope ||
         (bias.accelerometer - bias_.accelerometer).norm() > kFarAccelerometer;
}

void Preintegration::reintegrate(const ImuBias& bias) {
  bias_ = bias;
  integrate();
}

Vector6d Preintegration::walk_sigma() const {
  Vector6d sigma;
  sigma.head<3>().setConstant(noise_.gyroscope_walk * std::sqrt(duration_));
  sigma.tail<3>().setConstant(noise_.accelerometer_walk * std::sqrt(duration_));
  return sigma;
}

InertialState Preintegration::predict(const InertialState& from,
                                      const Eigen::Vector3d& gravity) const {
  const InertialDelta delta = corrected(from.bias);
  const Eigen::Quaterniond& rotation = from.world_from_body.rotation;
  InertialState to = from;
  to.world_from_body.rotation = (rotation * delta.rotation).normalized();
  to.world_from_body.translation +=
      duration_ * from.velocity + 0.5 * duration_ * duration_ * gravity + rotation * delta.position;
  to.velocity += duration_ * gravity + rotation * delta.velocity;
  return to;
}

}  // namespace rover
