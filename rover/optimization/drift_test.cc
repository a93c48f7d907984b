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

TEST(Drift, OfASimilarityIsWhereItLeads) {
  Random random(4);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d place = 5 * random_gaussian_vector(random);
    Eigen::Matrix<double, 7, 1> by;  // translation, turn, logarithm of scale
    for (double& value : by) value = random.gaussian();
    const Eigen::Vector3d turn = by.segment<3>(3);
    Eigen::Vector4d drift;
    drift << by.head<3>() + turn.cross(place) + by[6] * place -
                 turn.z() * Eigen::Vector3d::UnitZ().cross(place),
        turn.z();
    EXPECT_TRUE(drift_at(place, by * by.transpose()).isApprox(drift * drift.transpose(), 1e-9));
    const Eigen::Vector3d error(turn.x(), turn.y(), by[6]);
    EXPECT_TRUE(map_error_of(by * by.transpose()).isApprox(error * error.transpose(), 1e-9));
  }
}

TEST(Drift, OfAPoseIsTheSimilarityThatMovesIt) {
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    const SE3 pose{so3_exp(random_gaussian_vector(random)), 5 * random_gaussian_vector(random)};
    Eigen::Matrix<double, 7, 1> step;  // of the pose, and the logarithm of scale
    for (double& value : step) value = 1e-6 * random.gaussian();
    const Eigen::Matrix<double, 7, 1> by = similarity_by_pose(pose) * step;
    const Sim3 world(std::exp(by[6]), so3_exp(by.segment<3>(3)), by.head<3>());
    EXPECT_LT((se3_minus(move_pose(world, pose), pose) - step.head<6>()).norm(), 1e-9);
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

// Metres and radians do not compare, and another origin mixes them.
TEST(Drift, IsAtLeastAnotherInAnyUnits) {
  Random random(6);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Matrix4d a = random_drift(random), b = random_drift(random);
    Eigen::Matrix4d seen = Eigen::Vector4d(1, 1, 1, 1e-3).asDiagonal();
    seen.topRightCorner<3, 1>() = 1e-3 * random_gaussian_vector(random);
    const auto elsewhere = [&](const Eigen::Matrix4d& m) -> Eigen::Matrix4d {
      return seen * m * seen.transpose();
    };
    const Eigen::Matrix4d both = at_least(elsewhere(a), elsewhere(b));
    EXPECT_TRUE(both.isApprox(elsewhere(at_least(a, b)), 1e-6));
  }
}

TEST(Drift, IsAtLeastWhatIsKnownExactly) {
  const Eigen::Matrix4d none = Eigen::Matrix4d::Zero();
  const Eigen::Matrix4d high = Eigen::Vector4d(0, 0, 4, 0).asDiagonal();
  const Eigen::Matrix4d wide = Eigen::Vector4d(1, 0, 1, 0).asDiagonal();
  EXPECT_EQ(at_least(none, none), none);
  EXPECT_TRUE(at_least(none, high).isApprox(high));
  EXPECT_TRUE(at_least(high, none).isApprox(high));
  EXPECT_TRUE(
      at_least(wide, high).isApprox(Eigen::Vector4d(1, 0, 4, 0).asDiagonal().toDenseMatrix()));
}

}  // namespace
}  // namespace rover
