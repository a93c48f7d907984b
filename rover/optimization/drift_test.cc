#include "rover/optimization/drift.h"

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include "rover/geometry/random_geometry.h"

namespace rover {
namespace {

Eigen::Matrix4d random_drift(Random& random) {
  Eigen::Matrix4d root;
  for (double& value : root.reshaped()) value = random.gaussian();
  return root * root.transpose();
}

TEST(Drift, MovesAPoseAsItMovesTheWorld) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const SE3 pose{so3_exp(random_gaussian_vector(random)), 5 * random_gaussian_vector(random)};
    Eigen::Vector4d moved;
    moved << 1e-6 * random_gaussian_vector(random), 1e-6 * random.gaussian();
    const SE3 world{so3_exp({0, 0, moved[3]}), moved.head<3>()};
    const Vector6d error = se3_minus(world * pose, pose);
    const Matrix6d spread = with_drift(pose, Matrix6d::Zero(), moved * moved.transpose());
    EXPECT_TRUE(spread.isApprox(error * error.transpose(), 1e-4));
  }
}

TEST(Drift, IsFoundAgainInThePoseThatDrifted) {
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    const SE3 pose{so3_exp(random_gaussian_vector(random)), 5 * random_gaussian_vector(random)};
    const Eigen::Matrix4d drift = random_drift(random);
    EXPECT_TRUE(drift_of(pose, with_drift(pose, Matrix6d::Zero(), drift)).isApprox(drift, 1e-9));
  }
}

TEST(Drift, IsAtLeastAnother) {
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Matrix4d a = random_drift(random), b = random_drift(random);
    const Eigen::Matrix4d both = at_least(a, b);
    const auto smallest = [](const Eigen::Matrix4d& m) {
      return Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(m).eigenvalues()[0];
    };
    EXPECT_GT(smallest(both - a), -1e-9);
    EXPECT_GT(smallest(both - b), -1e-9);
    EXPECT_TRUE(at_least(both, a).isApprox(both, 1e-9));
  }
}

}  // namespace
}  // namespace rover
