#include "rover/simulation/motion_fit_problem.h"

#include <memory>

#include <gtest/gtest.h>

#include "rover/simulation/spline_jacobians.h"
#include "rover/simulation/test_motion.h"

namespace rover {
namespace {

TEST(SplineJacobians, AgreeWithDifferences) {
  constexpr double kStep = 1e-6;
  const SplineMotion motion = random_motion(0, 0.1, 12, 3);
  for (double t = 0.01; t < motion.end(); t += 0.043) {
    const SplineJacobians jacobians = SplineJacobians::at(motion, t);
    const MotionState state = motion.at(t);
    const int first = motion.place_of(t).first;
    for (int j = 0; j < kSplineOrder; ++j) {
      for (int axis = 0; axis < 3; ++axis) {
        std::vector<SE3> control = motion.control();
        SE3& moved = control[first + j];
        moved.rotation = moved.rotation * so3_exp(kStep * Eigen::Vector3d::Unit(axis));
        const MotionState other = SplineMotion(0, 0.1, control).at(t);
        const Eigen::Vector3d turn =
            so3_log(state.world_from_body.rotation.conjugate() * other.world_from_body.rotation);
        EXPECT_LT((turn / kStep - jacobians.orientation[j].col(axis)).norm(), 1e-5);
        const Eigen::Vector3d faster = other.angular_velocity - state.angular_velocity;
        EXPECT_LT((faster / kStep - jacobians.angular_velocity[j].col(axis)).norm(), 1e-4);
      }
    }
  }
}

// --- equations ----------------------------------------------------------------------------------

Eigen::MatrixXd dense_jacobian(const SplineResidual& residual, int control_points, int shared) {
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3, 6 * control_points + shared);
  jacobian.middleCols<SplineResidual::kBand>(6 * residual.first) = residual.by_control;
  for (std::size_t k = 0; k < residual.shared.size(); ++k) {
    jacobian.col(6 * control_points + residual.shared[k]) = residual.by_shared.col(k);
  }
  return jacobian;
}

TEST(SplineEquations, SolveLikeDenseOnes) {
  constexpr int kControl = 9, kShared = 5, kAll = 6 * kControl + kShared;
  Random random(1);
  const auto fill = [&](auto& matrix) {
    for (double& value : matrix.reshaped()) value = random.gaussian();
  };
  SplineEquations equations(kControl, kShared);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(kAll, kAll);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(kAll);
  for (int i = 0; i < 60; ++i) {
    SplineResidual residual;
    residual.first = i % 4;
    fill(residual.value);
    fill(residual.by_control);
    fill(residual.by_shared);
    residual.shared = {i % kShared, (i + 2) % kShared};
    const double weight = random.uniform(0.5, 2);
    equations.add(residual, weight);
    const Eigen::MatrixXd jacobian = dense_jacobian(residual, kControl, kShared);
    normal += weight * jacobian.transpose() * jacobian;
    gradient += weight * jacobian.transpose() * residual.value;
  }
  Eigen::VectorXd prior(kShared);
  fill(prior);
  equations.add_shared(prior, 2, 3);
  normal.bottomRightCorner(kShared, kShared) += 3 * prior * prior.transpose();
  gradient.tail(kShared) += 3 * 2 * prior;
  const auto step = equations.solve();
  ASSERT_TRUE(step.has_value());
  EXPECT_LT((normal * *step + gradient).norm(), 1e-5 * gradient.norm());
}

// --- residuals ----------------------------------------------------------------------------------

class Residuals : public ::testing::Test {
 protected:
  Residuals() {
    Random random(5);
    const SplineMotion motion = random_motion(0, 0.1, 30, 6);
    std::vector<MotionFitProblem::Pose> poses;
    for (double t = 0; t <= motion.end(); t += 0.05) {
      poses.push_back({t, motion.pose_at(t) * random_pose(random, 0.05, 0.1)});
    }
    std::vector<MotionFitProblem::Reading> readings;
    for (double t = 0; t <= motion.end(); t += 0.01) {
      readings.push_back({t, random_gaussian_vector(random), random_gaussian_vector(random)});
    }
    MotionFitOptions options;
    options.bias_interval = 1;
    problem = std::make_unique<MotionFitProblem>(poses, readings, motion.end(), 0.1, options);
    problem->step(0.02 * random_step(random));
  }

  Eigen::VectorXd random_step(Random& random) const {
    const auto control = static_cast<Eigen::Index>(problem->motion().control().size());
    Eigen::VectorXd step(6 * control + problem->shared_count());
    for (double& value : step) value = random.gaussian();
    return step;
  }

  // The derivative along random steps, times their size, is the change.
  template <class Residual>
  void expect_derivatives(const Residual& residual_of) const {
    constexpr double kSize = 1e-6;
    Random random(7);
    const SplineResidual residual = residual_of(*problem);
    const auto control = static_cast<int>(problem->motion().control().size());
    const Eigen::MatrixXd jacobian = dense_jacobian(residual, control, problem->shared_count());
    for (int i = 0; i < 20; ++i) {
      const Eigen::VectorXd step = random_step(random);
      MotionFitProblem before = *problem, after = *problem;
      before.step(-kSize * step);
      after.step(kSize * step);
      const Eigen::Vector3d change = residual_of(after).value - residual_of(before).value;
      EXPECT_LT((change / (2 * kSize) - jacobian * step).norm(), 1e-5 * (jacobian * step).norm());
    }
  }

  std::unique_ptr<MotionFitProblem> problem;
};

TEST_F(Residuals, HaveTheDerivativesTheyState) {
  Random random(8);
  const MotionFitProblem::Pose pose = {1.234, random_pose(random)};
  const MotionFitProblem::Reading reading = {1.432, {0.1, 0.2, 0.3}, {1, 2, 3}};
  expect_derivatives([&](const MotionFitProblem& p) { return p.position_residual(pose); });
  expect_derivatives([&](const MotionFitProblem& p) { return p.rotation_residual(pose); });
  expect_derivatives([&](const MotionFitProblem& p) { return p.gyroscope_residual(reading); });
  expect_derivatives([&](const MotionFitProblem& p) { return p.accelerometer_residual(reading); });
}

TEST(Biases, AreLinearBetweenNodes) {
  const std::vector<BiasNode> nodes = {
      {0, {{0, 0, 0}, {1, 1, 1}}}, {2, {{2, 0, 0}, {1, 1, 1}}}, {4, {{2, 4, 0}, {1, 1, 1}}}};
  EXPECT_EQ(bias_at(nodes, -1).gyroscope, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(bias_at(nodes, 0.5).gyroscope, Eigen::Vector3d(0.5, 0, 0));
  EXPECT_EQ(bias_at(nodes, 3).gyroscope, Eigen::Vector3d(2, 2, 0));
  EXPECT_EQ(bias_at(nodes, 3).accelerometer, Eigen::Vector3d(1, 1, 1));
  EXPECT_EQ(bias_at(nodes, 9).gyroscope, Eigen::Vector3d(2, 4, 0));
  EXPECT_EQ(bias_at({}, 1).gyroscope, Eigen::Vector3d::Zero());
}

}  // namespace
}  // namespace rover
