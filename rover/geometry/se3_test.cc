#include "rover/geometry/se3.h"

#include <numbers>

#include <gtest/gtest.h>

#include "rover/geometry/random_geometry.h"

namespace rover {
namespace {

constexpr int kCases = 2000;

Vector6d random_tangent(Random& random, int i) {
  constexpr double kAngles[] = {0, 1e-12, 1e-6, 1e-2, 1, 3, std::numbers::pi - 1e-7};
  Vector6d tangent;
  tangent << 3 * random_gaussian_vector(random), kAngles[i % 7] * random_direction(random);
  return tangent;
}

double difference(const SE3& a, const SE3& b) { return (a.matrix() - b.matrix()).norm(); }

TEST(Se3, GroupLaws) {
  Random random(1);
  for (int i = 0; i < kCases; ++i) {
    const SE3 a = random_pose(random), b = random_pose(random), c = random_pose(random);
    const Eigen::Vector3d p = random_gaussian_vector(random);
    EXPECT_LT(difference((a * b) * c, a * (b * c)), 1e-13);
    EXPECT_LT(difference(a * a.inverse(), SE3()), 1e-14);
    EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-13);
    EXPECT_LT(((a * b).matrix() - a.matrix() * b.matrix()).norm(), 1e-13);
    EXPECT_LT((a * p - (a.matrix() * p.homogeneous()).head<3>()).norm(), 1e-13);
  }
}

TEST(Se3, FromMatrixInvertsMatrix) {
  Random random(2);
  for (int i = 0; i < kCases; ++i) {
    const SE3 a = random_pose(random);
    EXPECT_LT(difference(SE3::from_matrix(a.matrix()), a), 1e-14);
    EXPECT_LT((SE3(a.rotation_matrix(), a.translation).matrix() - a.matrix()).norm(), 1e-14);
  }
}

TEST(Se3, LogInvertsExp) {
  Random random(3);
  for (int i = 0; i < kCases; ++i) {
    const Vector6d tangent = random_tangent(random, i);
    EXPECT_LT((se3_log(se3_exp(tangent)) - tangent).norm(), 1e-13 * (1 + tangent.norm()));
  }
}

TEST(Se3, ExpIsTheMatrixSeries) {
  Random random(4);
  for (int i = 0; i < kCases; ++i) {
    const Vector6d tangent = random_tangent(random, i);
    Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
    generator.topLeftCorner<3, 3>() = skew(tangent.tail<3>());
    generator.topRightCorner<3, 1>() = tangent.head<3>();
    Eigen::Matrix4d sum = Eigen::Matrix4d::Identity(), term = sum;
    for (int k = 1; k < 40; ++k) {
      term = term * generator / k;
      sum += term;
    }
    EXPECT_LT((se3_exp(tangent).matrix() - sum).norm(), 1e-13 * (1 + tangent.norm()));
  }
}

TEST(Se3, AdjointMovesTangentsThroughTheTransform) {
  Random random(5);
  for (int i = 0; i < kCases; ++i) {
    const SE3 a = random_pose(random);
    const Vector6d d = 0.3 * random_tangent(random, i);
    EXPECT_LT(difference(a * se3_exp(d) * a.inverse(), se3_exp(a.adjoint() * d)), 1e-12);
  }
}

TEST(Se3, MinusInvertsPlus) {
  Random random(6);
  for (int i = 0; i < kCases; ++i) {
    const SE3 a = random_pose(random);
    const Vector6d d = random_tangent(random, i);
    EXPECT_LT((se3_minus(se3_plus(a, d), a) - d).norm(), 1e-12);
  }
}

TEST(Se3, PlusIsTheExponentialToFirstOrder) {
  Random random(7);
  for (int i = 0; i < kCases; ++i) {
    const SE3 a = random_pose(random);
    Vector6d d;
    d << random_direction(random), random_direction(random);
    const double small = 1e-5;
    EXPECT_LT(difference(se3_plus(a, small * d), a * se3_exp(small * d)), small * small);
  }
}

}  // namespace
}  // namespace rover
