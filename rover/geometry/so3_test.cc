#include "rover/geometry/so3.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "rover/geometry/random_geometry.h"

namespace rover {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kCases = 2000;

// Angles where the formulas change or are singular, and everything between.
double test_angle(Random& random, int i) {
  constexpr double kSpecial[] = {0,    1e-300, 1e-160, 1e-20, 1e-12,      1e-8,
                                 1e-4, 9e-3,   1.1e-2, 0.5,   kPi - 1e-3, kPi - 1e-9};
  constexpr int kSpecials = sizeof(kSpecial) / sizeof(kSpecial[0]);
  return i % 2 == 0 ? kSpecial[(i / 2) % kSpecials] : random.uniform(0, kPi);
}

TEST(So3, SkewIsTheCrossProduct) {
  Random random(1);
  for (int i = 0; i < kCases; ++i) {
    const Eigen::Vector3d a = random_gaussian_vector(random), b = random_gaussian_vector(random);
    EXPECT_TRUE((skew(a) * b).isApprox(a.cross(b), 1e-14));
  }
}

TEST(So3, ExpAgreesWithAngleAxisAndIsUnit) {
  Random random(2);
  for (int i = 0; i < kCases; ++i) {
    const Eigen::Vector3d axis = random_direction(random);
    const double angle = test_angle(random, i);
    const Eigen::Quaterniond rotation = so3_exp(angle * axis);
    const Eigen::Quaterniond expected(Eigen::AngleAxisd(angle, axis));
    EXPECT_NEAR(rotation.norm(), 1, 1e-15);
    EXPECT_LT((rotation.coeffs() - expected.coeffs()).norm(), 1e-15);
  }
}

TEST(So3, LogInvertsExpToRounding) {
  Random random(3);
  for (int i = 0; i < kCases; ++i) {
    const Eigen::Vector3d v = test_angle(random, i) * random_direction(random);
    const Eigen::Vector3d back = so3_log(so3_exp(v));
    EXPECT_LE((back - v).norm(), 2e-15 * v.norm() + 1e-300) << v.transpose();
  }
}

TEST(So3, LogTakesBothSignsOfAQuaternionAndIsAtMostPi) {
  Random random(4);
  for (int i = 0; i < kCases; ++i) {
    const Eigen::Quaterniond q = so3_exp(random.uniform(0, 4 * kPi) * random_direction(random));
    const Eigen::Quaterniond negated(-q.w(), -q.x(), -q.y(), -q.z());
    const Eigen::Vector3d v = so3_log(q);
    EXPECT_LE(v.norm(), kPi + 1e-15);
    EXPECT_LT((v - so3_log(negated)).norm(), 1e-14);
    EXPECT_LT(so3_exp(v).angularDistance(q), 1e-7);
    EXPECT_LT((so3_exp(v).toRotationMatrix() - q.toRotationMatrix()).norm(), 1e-14);
  }
}

TEST(So3, LogAtExactlyPiAndAtIdentity) {
  EXPECT_DOUBLE_EQ(so3_log(Eigen::Quaterniond(0, 0, 1, 0)).y(), kPi);
  EXPECT_EQ(so3_log(Eigen::Quaterniond::Identity()), Eigen::Vector3d::Zero());
  EXPECT_EQ(so3_log(Eigen::Quaterniond(-1, 0, 0, 0)).norm(), 0);
}

TEST(So3, RightJacobianAgreesWithDifferences) {
  Random random(5);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < kCases; ++i) {
    const Eigen::Vector3d v = test_angle(random, i) * random_direction(random);
    const Eigen::Quaterniond inverse = so3_exp(v).conjugate();
    Eigen::Matrix3d numeric;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d d = kStep * Eigen::Vector3d::Unit(k);
      numeric.col(k) =
          (so3_log(inverse * so3_exp(v + d)) - so3_log(inverse * so3_exp(v - d))) / (2 * kStep);
    }
    EXPECT_LT((so3_right_jacobian(v) - numeric).norm(), 1e-9) << v.transpose();
  }
}

TEST(So3, RightJacobianInverseIsTheInverse) {
  Random random(6);
  for (int i = 0; i < kCases; ++i) {
    const Eigen::Vector3d v = test_angle(random, i) * random_direction(random);
    const Eigen::Matrix3d product = so3_right_jacobian(v) * so3_right_jacobian_inverse(v);
    EXPECT_LT((product - Eigen::Matrix3d::Identity()).norm(), 1e-12) << v.transpose();
  }
}

}  // namespace
}  // namespace rover
