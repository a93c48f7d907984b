#include "rover/geometry/sim3.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "rover/geometry/random_geometry.h"

namespace rover {
namespace {

constexpr int kCases = 4000;
constexpr double kValues[] = {0, 1e-12, 1e-7, 1e-4, 1e-2, 0.4, 0.6, 1.5};

// All pairs of vanishing, small and large angle and log scale.
Vector7d random_tangent(Random& random, int i) {
  const double angle = (i / 64) % 4 == 0 ? std::numbers::pi - 1e-7 : kValues[i % 8];
  const double log_scale = (i % 2 ? 1 : -1) * kValues[(i / 8) % 8];
  Vector7d tangent;
  tangent << 3 * random_gaussian_vector(random), angle * random_direction(random), log_scale;
  return tangent;
}

Sim3 random_similarity(Random& random) {
  return Sim3(random_pose(random), std::exp(random.gaussian()));
}

double difference(const Sim3& a, const Sim3& b) { return (a.matrix() - b.matrix()).norm(); }

TEST(Sim3, GroupLaws) {
  Random random(1);
  for (int i = 0; i < kCases; ++i) {
    const Sim3 a = random_similarity(random), b = random_similarity(random);
    const Eigen::Vector3d p = random_gaussian_vector(random);
    const double size = 1 + a.matrix().norm() * b.matrix().norm();
    EXPECT_LT(difference(a * a.inverse(), Sim3()), 1e-13 * (1 + a.inverse().matrix().norm()));
    EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-14 * size * (1 + p.norm()));
    EXPECT_LT(((a * b).matrix() - a.matrix() * b.matrix()).norm(), 1e-13 * size);
    EXPECT_LT((a * p - (a.matrix() * p.homogeneous()).head<3>()).norm(), 1e-13 * size);
  }
}

TEST(Sim3, OfARigidTransformIsThatTransform) {
  Random random(2);
  for (int i = 0; i < kCases; ++i) {
    const SE3 a = random_pose(random);
    EXPECT_EQ(Sim3(a).matrix(), a.matrix());
    Vector7d tangent;
    tangent << se3_log(a), 0;
    EXPECT_LT((sim3_log(Sim3(a)) - tangent).norm(), 1e-12 * (1 + tangent.norm()));
  }
}

TEST(Sim3, ExpIsTheMatrixSeries) {
  Random random(3);
  for (int i = 0; i < kCases; ++i) {
    const Vector7d tangent = random_tangent(random, i);
    Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
    generator.topLeftCorner<3, 3>() =
        skew(tangent.segment<3>(3)) + tangent[6] * Eigen::Matrix3d::Identity();
    generator.topRightCorner<3, 1>() = tangent.head<3>();
    Eigen::Matrix4d sum = Eigen::Matrix4d::Identity(), term = sum;
    for (int k = 1; k < 60; ++k) {
      term = term * generator / k;
      sum += term;
    }
    EXPECT_LT((sim3_exp(tangent).matrix() - sum).norm(), 1e-13 * (1 + sum.norm()))
        << tangent.transpose();
  }
}

TEST(Sim3, LogInvertsExp) {
  Random random(4);
  for (int i = 0; i < kCases; ++i) {
    const Vector7d tangent = random_tangent(random, i);
    EXPECT_LT((sim3_log(sim3_exp(tangent)) - tangent).norm(), 1e-12 * (1 + tangent.norm()))
        << tangent.transpose();
  }
}

TEST(Sim3, AdjointMovesTangentsThroughTheTransform) {
  Random random(5);
  for (int i = 0; i < kCases; ++i) {
    const Sim3 a = random_similarity(random);
    const Vector7d d = 0.3 * random_tangent(random, i);
    const Sim3 expected = sim3_exp(a.adjoint() * d);
    EXPECT_LT(difference(a * sim3_exp(d) * a.inverse(), expected),
              1e-12 * (1 + expected.matrix().norm()) * (1 + a.matrix().norm() / a.scale));
  }
}

// What a loop correction does to a map must not change what its cameras see.
TEST(Sim3, MovingPoseAndPointsLeavesBearings) {
  Random random(6);
  for (int i = 0; i < kCases; ++i) {
    const Sim3 a_from_b = random_similarity(random);
    const SE3 b_from_camera = random_pose(random);
    const Eigen::Vector3d point = random_gaussian_vector(random);
    const Eigen::Vector3d before = b_from_camera.inverse() * point;
    const Eigen::Vector3d after = move_pose(a_from_b, b_from_camera).inverse() * (a_from_b * point);
    EXPECT_LT((after - a_from_b.scale * before).norm(),
              1e-13 * (1 + a_from_b.matrix().norm()) * (1 + before.norm()));
  }
}

}  // namespace
}  // namespace rover
