#include "rover/optimization/imu_factor.h"

#include <gtest/gtest.h>

#include "rover/imu/simulated_motion.h"

namespace rover {
namespace {

struct Case {
  Preintegration motion;
  InertialState from, to;
  Eigen::Vector3d gravity;
};

// States near the motion that was integrated, with a bias off the one integrated with.
Case random_case(Random& random) {
  const auto motion = SimulatedMotion::random(random);
  const ImuBias bias = {0.01 * random_gaussian_vector(random),
                        0.1 * random_gaussian_vector(random)};
  Case result = {{simulate_imu(motion, 1, 1.3, 200, bias, simulated_noise(), random), bias,
                  simulated_noise(10)},
                 motion.state(1, bias),
                 motion.state(1.3, bias),
                 gravity_of_z_up() + random_gaussian_vector(random)};
  const auto disturb = [&](InertialState& state) {
    Vector15d delta;
    for (int k = 0; k < 15; ++k) delta[k] = 0.05 * random.gaussian();
    delta.segment<3>(9) *= 0.2;
    state = state_plus(state, delta);
  };
  disturb(result.from);
  disturb(result.to);
  return result;
}

template <class Function>
Matrix15d numeric_jacobian(const Function& residual, const InertialState& state) {
  Matrix15d jacobian;
  const double step = 1e-5;
  for (int k = 0; k < 15; ++k) {
    const Vector15d delta = step * Vector15d::Unit(k);
    jacobian.col(k) =
        (residual(state_plus(state, delta)) - residual(state_plus(state, -delta))) / (2 * step);
  }
  return jacobian;
}

template <class A, class B>
void expect_near(const A& actual, const B& expected) {
  EXPECT_LT((actual - expected).norm(), 1e-6 * expected.norm());
}

TEST(ImuFactor, JacobiansAgreeWithNumericOnes) {
  Random random(1);
  for (int i = 0; i < 30; ++i) {
    const Case c = random_case(random);
    ImuJacobians by;
    imu_residual(c.motion, c.from, c.to, c.gravity, &by);
    expect_near(by.by_from, numeric_jacobian(
                                [&](const InertialState& s) {
                                  return imu_residual(c.motion, s, c.to, c.gravity);
                                },
                                c.from));
    expect_near(by.by_to, numeric_jacobian(
                              [&](const InertialState& s) {
                                return imu_residual(c.motion, c.from, s, c.gravity);
                              },
                              c.to));
    Matrix15x3d by_gravity;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d d = 1e-4 * Eigen::Vector3d::Unit(k);
      by_gravity.col(k) = (imu_residual(c.motion, c.from, c.to, c.gravity + d) -
                           imu_residual(c.motion, c.from, c.to, c.gravity - d)) /
                          2e-4;
    }
    expect_near(by.by_gravity, by_gravity);
  }
}

TEST(ImuFactor, VanishesWhereThePredictionIs) {
  Random random(2);
  for (int i = 0; i < 30; ++i) {
    const Case c = random_case(random);
    const InertialState predicted = c.motion.predict(c.from, c.gravity);
    EXPECT_LT(imu_residual(c.motion, c.from, predicted, c.gravity).norm(), 1e-6);
  }
}

TEST(ImuFactor, DoesNotDependOnWhereTheWorldIs) {
  Random random(3);
  for (int i = 0; i < 30; ++i) {
    const Case c = random_case(random);
    const SE3 motion = random_pose(random, 5);
    const auto moved = [&](InertialState state) {
      state.world_from_body = motion * state.world_from_body;
      state.velocity = motion.rotation * state.velocity;
      return state;
    };
    const Vector15d before = imu_residual(c.motion, c.from, c.to, c.gravity);
    const Vector15d after =
        imu_residual(c.motion, moved(c.from), moved(c.to), motion.rotation * c.gravity);
    expect_near(after, before);
  }
}

TEST(ImuFactor, NoiseComesOutWhite) {
  Random random(4);
  const ImuNoise noise = simulated_noise(10);
  double sum = 0;
  const int runs = 400;
  for (int i = 0; i < runs; ++i) {
    const auto motion = SimulatedMotion::random(random);
    const Preintegration measured(simulate_imu(motion, 0, 0.3, 200, {}, noise, random), {}, noise);
    const Vector15d residual =
        imu_residual(measured, motion.state(0), motion.state(0.3), gravity_of_z_up());
    sum += residual.head<9>().squaredNorm() / runs;
  }
  EXPECT_NEAR(sum, 9, 4 * std::sqrt(18.0 / runs));
}

TEST(ImuFactor, EquationsAreThoseOfTheResidual) {
  Random random(5);
  const Case c = random_case(random);
  ImuJacobians by;
  const Vector15d residual = imu_residual(c.motion, c.from, c.to, c.gravity, &by);
  Eigen::Matrix<double, 15, 30> jacobian;
  jacobian << by.by_to, by.by_from;
  DenseEquations equations;
  equations.reset(30);
  add_imu_factor(c.motion, c.from, c.to, c.gravity, 15, 0, equations);
  const Eigen::MatrixXd full = equations.hessian.selfadjointView<Eigen::Lower>();
  expect_near(full, (jacobian.transpose() * jacobian).eval());
  expect_near(equations.gradient, (jacobian.transpose() * residual).eval());
  EXPECT_NEAR(equations.cost, 0.5 * residual.squaredNorm(), 1e-9 * equations.cost);
}

TEST(StatePrior, JacobianAgreesWithNumericOne) {
  Random random(6);
  for (int i = 0; i < 30; ++i) {
    const Case c = random_case(random);
    StatePrior prior;
    prior.mean = c.to;
    Matrix15d by_state;
    prior_difference(prior, c.from, &by_state);
    expect_near(by_state,
                numeric_jacobian([&](const InertialState& s) { return prior_difference(prior, s); },
                                 c.from));
  }
}

TEST(StatePrior, PartsPullOnTheirPartOfTheState) {
  Random random(7);
  const Case c = random_case(random);
  const auto gradient_of = [&](const StatePrior& prior) {
    DenseEquations equations;
    equations.reset(15);
    add_prior(prior, c.from, 0, equations);
    return equations.gradient;
  };
  const Eigen::VectorXd still = gradient_of(zero_velocity_prior(0.1));
  expect_near(still.segment<3>(6), (c.from.velocity * 100).eval());
  EXPECT_TRUE(still.head<6>().isZero() && still.tail<6>().isZero());
  const Eigen::VectorXd biased = gradient_of(bias_prior({}, 0.1, 0.5));
  expect_near(biased.segment<3>(9), (c.from.bias.gyroscope * 100).eval());
  expect_near(biased.tail<3>(), (c.from.bias.accelerometer * 4).eval());
  EXPECT_TRUE(biased.head<9>().isZero());
  EXPECT_TRUE(gradient_of(pose_prior(c.from.world_from_body, 0.1, 0.1)).isZero(1e-9));
  EXPECT_GT(gradient_of(pose_prior(c.to.world_from_body, 0.1, 0.1)).head<6>().norm(), 1);
}

}  // namespace
}  // namespace rover
