#include "rover/geometry/so3.h"

#include <cmath>

namespace rover {
namespace {

// Below this squared angle the series are exact to rounding and the closed forms lose digits.
constexpr double kSmallSquaredAngle = 1e-4;

// sin(x / 2) / x
double half_sinc(double squared) {
  if (squared < kSmallSquaredAngle)
    return 0.5 + squared * (-1.0 / 48 + squared * (1.0 / 3840 - squared / 645120));
  const double angle = std::sqrt(squared);
  return std::sin(0.5 * angle) / angle;
}

// (x - sin x) / x^3
double cubic_sine(double squared) {
  if (squared < kSmallSquaredAngle)
    return 1.0 / 6 + squared * (-1.0 / 120 + squared * (1.0 / 5040 - squared / 362880));
  const double angle = std::sqrt(squared);
  return (angle - std::sin(angle)) / (angle * squared);
}

// (1 - (x / 2) cot(x / 2)) / x^2
double half_cotangent(double squared) {
  if (squared < kSmallSquaredAngle)
    return 1.0 / 12 + squared * (1.0 / 720 + squared * (1.0 / 30240 + squared / 1209600));
  const double half = 0.5 * std::sqrt(squared);
  return (1 - half * std::cos(half) / std::sin(half)) / squared;
}

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

Eigen::Quaterniond so3_exp(const Eigen::Vector3d& rotation_vector) {
  const double squared = rotation_vector.squaredNorm();
  Eigen::Quaterniond rotation;
  rotation.w() = std::cos(0.5 * std::sqrt(squared));
  rotation.vec() = half_sinc(squared) * rotation_vector;
  return rotation;
}

Eigen::Vector3d so3_log(const Eigen::Quaterniond& rotation) {
  // q and -q are one rotation; the one with w >= 0 has the angle of at most pi.
  const double sign = rotation.w() < 0 ? -1 : 1;
  const double cosine = sign * rotation.w();
  const double sine = rotation.vec().stableNorm();
  const double angle_by_sine = sine > 0 ? 2 * std::atan2(sine, cosine) / sine : 2;
  return sign * angle_by_sine * rotation.vec();
}

// Solà et al., equations 143 and 144; 1 - cos x is written as 2 sin(x / 2)^2 against cancellation.
Eigen::Matrix3d so3_right_jacobian(const Eigen::Vector3d& rotation_vector) {
  const double squared = rotation_vector.squaredNorm();
  const double sinc = half_sinc(squared);
  const Eigen::Matrix3d k = skew(rotation_vector);
  return Eigen::Matrix3d::Identity() - 2 * sinc * sinc * k + cubic_sine(squared) * k * k;
}

Eigen::Matrix3d so3_right_jacobian_inverse(const Eigen::Vector3d& rotation_vector) {
  const Eigen::Matrix3d k = skew(rotation_vector);
  return Eigen::Matrix3d::Identity() + 0.5 * k +
         half_cotangent(rotation_vector.squaredNorm()) * k * k;
}

}  // namespace rover
