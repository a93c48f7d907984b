#include "rover/geometry/sim3.h"

#include <array>
#include <cmath>

#include <Eigen/LU>

namespace rover {
namespace {

using Series = std::array<double, 3>;

// The integrals over u in [0, 1] of e^(l u) times 1, sin(a u) / a and (1 - cos(a u)) / a^2, by the
// power series in l and a: for |l|, a < 0.5 the terms left out are below 1e-17.
Series integrals_by_series(double l, double a) {
  constexpr int kTerms = 16;
  Series sum = {0, 0, 0};
  double power_of_l = 1;  // l^i / i!
  for (int i = 0; i < kTerms; ++i) {
    double power_of_a = 1;  // (-a^2)^j / (2 j)!
    for (int j = 0; j < kTerms / 2; ++j) {
      const double n = 2.0 * j;
      if (j == 0) sum[0] += power_of_l / (i + 1);
      sum[1] += power_of_l * power_of_a / ((n + 1) * (i + n + 2));
      sum[2] += power_of_l * power_of_a / ((n + 1) * (n + 2) * (i + n + 3));
      power_of_a *= -a * a / ((n + 1) * (n + 2));
    }
    power_of_l *= l / (i + 1);
  }
  return sum;
}

// The same in closed form: the integral of e^((l + i a) u) is (e^(l + i a) - 1) / (l + i a).
Series integrals_in_closed_form(double l, double a) {
  const double square = l * l + a * a;
  const double grown = std::exp(l);
  const double real = grown * std::cos(a) - 1, imaginary = grown * std::sin(a);
  const double plain = std::abs(l) > 1e-5 ? std::expm1(l) / l : 1 + l / 2 + l * l / 6;
  const double cosine = (real * l + imaginary * a) / square;
  const double sine = (imaginary * l - real * a) / square;
  return {plain, sine / a, (plain - cosine) / (a * a)};
}

// The matrix that takes the tangent's translation to the transform's.
Eigen::Matrix3d translation_matrix(const Eigen::Vector3d& rotation, double log_scale) {
  constexpr double kSmall = 0.5;
  const double angle = rotation.norm();
  // With a small angle alone, the closed form loses the digits of (1 - cos a) / a^2.
  Series c;
  if (angle >= kSmall || std::abs(log_scale) < kSmall) {
    c = angle >= kSmall ? integrals_in_closed_form(log_scale, angle)
                        : integrals_by_series(log_scale, angle);
  } else {
    // e^(l u) = e^(l / n)^(n u): n parts of the interval, each of which has a small log scale.
    const Eigen::Vector3d half = 0.5 * rotation;
    const Eigen::Matrix3d part = translation_matrix(half, 0.5 * log_scale);
    return 0.5 * (part + std::exp(0.5 * log_scale) * (so3_exp(half) * part));
  }
  const Eigen::Matrix3d k = skew(rotation);
  return c[0] * Eigen::Matrix3d::Identity() + c[1] * k + c[2] * k * k;
}

}  // namespace

Eigen::Matrix4d Sim3::matrix() const {
  Eigen::Matrix4d matrix = SE3(rotation, translation).matrix();
  matrix.topLeftCorner<3, 3>() *= scale;
  return matrix;
}

Matrix7d Sim3::adjoint() const {
  const Eigen::Matrix3d r = rotation.toRotationMatrix();
  Matrix7d adjoint = Matrix7d::Zero();
  adjoint.topLeftCorner<3, 3>() = scale * r;
  adjoint.block<3, 3>(0, 3) = skew(translation) * r;
  adjoint.block<3, 1>(0, 6) = -translation;
  adjoint.block<3, 3>(3, 3) = r;
  adjoint(6, 6) = 1;
  return adjoint;
}

Sim3 sim3_exp(const Vector7d& tangent) {
  const Eigen::Vector3d rotation = tangent.segment<3>(3);
  return {std::exp(tangent[6]), so3_exp(rotation),
          translation_matrix(rotation, tangent[6]) * tangent.head<3>()};
}

Vector7d sim3_log(const Sim3& transform) {
  const Eigen::Vector3d rotation = so3_log(transform.rotation);
  const double log_scale = std::log(transform.scale);
  Vector7d tangent;
  tangent << translation_matrix(rotation, log_scale).inverse() * transform.translation, rotation,
      log_scale;
  return tangent;
}

}  // namespace rover
