#include "rover/imu/preintegration.h"

#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "rover/base/error.h"
#include "rover/imu/simulated_motion.h"

namespace rover {
namespace {

const ImuBias kBias = {{0.01, -0.02, 0.03}, {0.1, -0.05, 0.08}};

ImuNoise no_noise() { return {.gap = 1}; }

// The error of `to` against `from` as preintegration orders it.
Vector9d difference(const InertialDelta& to, const InertialDelta& from) {
  Vector9d error;
  error << to.position - from.position, so3_log(from.rotation.conjugate() * to.rotation),
      to.velocity - from.velocity;
  return error;
}

Preintegration preintegrate(const SimulatedMotion& motion, double duration, double rate,
                            const ImuBias& bias) {
  Random random(1);
  return {simulate_imu(motion, 1, 1 + duration, rate, bias, no_noise(), random), bias,
          simulated_noise()};
}

double whitened(const Preintegration& motion, const Vector9d& error) {
  return (motion.whitening().topLeftCorner<9, 9>() * error).norm();
}

TEST(Preintegration, PredictsTheTrueMotion) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const auto motion = SimulatedMotion::random(random);
    const auto integrated = preintegrate(motion, 0.5, 200, kBias);
    const auto predicted = integrated.predict(motion.state(1, kBias), gravity_of_z_up());
    const Vector15d error = state_minus(predicted, motion.state(1.5, kBias));
    EXPECT_LT(error.head<3>().norm(), 1e-4);
    EXPECT_LT(error.segment<3>(3).norm(), 1e-4);
    EXPECT_LT(error.segment<3>(6).norm(), 4e-4);
    EXPECT_TRUE(error.tail<6>().isZero());
  }
}

TEST(Preintegration, AgreesWithFineIntegrationToSecondOrder) {
  Random random(2);
  for (int i = 0; i < 10; ++i) {
    const auto motion = SimulatedMotion::random(random);
    const auto fine = preintegrate(motion, 0.5, 10'000, kBias);
    const double coarse =
        difference(preintegrate(motion, 0.5, 100, kBias).delta(), fine.delta()).norm();
    const double half =
        difference(preintegrate(motion, 0.5, 200, kBias).delta(), fine.delta()).norm();
    EXPECT_LT(coarse, 1e-3);
    EXPECT_NEAR(coarse / half, 4, 0.2);
  }
}

TEST(Preintegration, BiasJacobiansAreThoseOfIntegration) {
  Random random(3);
  for (int i = 0; i < 10; ++i) {
    const auto base = preintegrate(SimulatedMotion::random(random), 0.5, 200, kBias);
    const double step = 1e-5;
    for (int k = 0; k < 6; ++k) {
      Vector6d delta = Vector6d::Zero();
      delta[k] = step;
      auto plus = base, minus = base;
      plus.reintegrate(ImuBias::from_vector(kBias.vector() + delta));
      minus.reintegrate(ImuBias::from_vector(kBias.vector() - delta));
      const Vector9d numeric = difference(plus.delta(), minus.delta()) / (2 * step);
      EXPECT_LT((numeric - base.by_bias().col(k)).norm(), 1e-5);
    }
  }
}

TEST(Preintegration, FirstOrderHoldsUntilTheBiasIsFar) {
  Random random(4);
  for (int i = 0; i < 10; ++i) {
    const auto base = preintegrate(SimulatedMotion::random(random), 0.5, 200, kBias);
    ImuBias near = kBias;
    near.gyroscope += 0.0095 * random_direction(random);
    near.accelerometer += 0.19 * random_direction(random);
    ASSERT_FALSE(base.is_far(near));
    auto again = base;
    again.reintegrate(near);
    const Vector9d error = difference(base.corrected(near), again.delta());
    EXPECT_LT(whitened(again, error), 1);  // far below even the sensor's own noise
    near.gyroscope += Eigen::Vector3d(0.02, 0, 0);
    EXPECT_TRUE(base.is_far(near));
  }
}

TEST(Preintegration, CovarianceIsThatOfManyRuns) {
  Random random(5);
  const auto motion = SimulatedMotion::random(random);
  const ImuNoise noise = simulated_noise(10);
  const auto clean = preintegrate(motion, 0.5, 200, kBias);
  const int runs = 3000;
  Matrix9d sampled = Matrix9d::Zero();
  Matrix9d covariance;
  for (int i = 0; i < runs; ++i) {
    const Preintegration noisy(simulate_imu(motion, 1, 1.5, 200, kBias, noise, random), kBias,
                               noise);
    const Vector9d error = difference(clean.delta(), noisy.delta());
    sampled += error * error.transpose() / runs;
    covariance = noisy.covariance();
  }
  // L^-1 S L^-T would be the identity; its sampling error is 1 / sqrt(runs) off the diagonal.
  const Eigen::LLT<Matrix9d> factor(covariance);
  const Matrix9d left = factor.matrixL().solve(sampled);
  const Matrix9d whitened = factor.matrixL().solve(left.transpose());
  EXPECT_LT((whitened - Matrix9d::Identity()).cwiseAbs().maxCoeff(), 6 / std::sqrt(runs));
}

// Readings whose biases walk by much.
std::vector<ImuSample> with_walk(std::vector<ImuSample> samples, const ImuNoise& noise, double rate,
                                 Random& random, Vector6d& walked) {
  walked.setZero();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i].angular_velocity += walked.head<3>();
    samples[i].acceleration += walked.tail<3>();
    if (i + 1 == samples.size()) break;
    walked.head<3>() += noise.gyroscope_walk / std::sqrt(rate) * random_gaussian_vector(random);
    walked.tail<3>() += noise.accelerometer_walk / std::sqrt(rate) * random_gaussian_vector(random);
  }
  return samples;
}

TEST(Preintegration, WhiteningTakesInHowBiasesWalkMeanwhile) {
  Random random(9);
  const auto motion = SimulatedMotion::random(random);
  ImuNoise noise = simulated_noise();
  noise.gyroscope_walk *= 100;
  noise.accelerometer_walk *= 100;
  const auto clean = preintegrate(motion, 0.5, 200, kBias);
  const int runs = 3000;
  Matrix15d sampled = Matrix15d::Zero();
  for (int i = 0; i < runs; ++i) {
    Vector6d walked;
    const auto samples = simulate_imu(motion, 1, 1.5, 200, kBias, noise, random);
    const Preintegration noisy(with_walk(samples, noise, 200, random, walked), kBias, noise);
    Vector15d error;
    error << difference(clean.delta(), noisy.delta()), walked;
    const Vector15d white = noisy.whitening() * error;
    sampled += white * white.transpose() / runs;
  }
  EXPECT_LT((sampled - Matrix15d::Identity()).cwiseAbs().maxCoeff(), 7 / std::sqrt(runs));
}

TEST(Preintegration, GapsCostCertainty) {
  Random random(6);
  const auto motion = SimulatedMotion::random(random);
  auto samples = simulate_imu(motion, 1, 2, 200, {}, no_noise(), random);
  const Preintegration whole(samples, {}, simulated_noise());
  samples.erase(samples.begin() + 50, samples.begin() + 150);
  const Preintegration broken(samples, {}, simulated_noise());
  EXPECT_NEAR(broken.longest_step(), 0.505, 1e-6);
  const Vector9d error = difference(broken.delta(), whole.delta());
  EXPECT_GT(whitened(whole, error), 20);
  EXPECT_LT(whitened(broken, error), 4);
}

TEST(Preintegration, MergesNeighbours) {
  Random random(7);
  const auto motion = SimulatedMotion::random(random);
  const auto samples = simulate_imu(motion, 0, 1, 200, kBias, no_noise(), random);
  const Preintegration whole(samples, kBias, simulated_noise());
  const Preintegration first({samples.begin(), samples.begin() + 81}, kBias, simulated_noise());
  const Preintegration second({samples.begin() + 80, samples.end()}, {}, simulated_noise());
  const auto merged = Preintegration::merged(first, second);
  EXPECT_EQ(merged.begin(), whole.begin());
  EXPECT_EQ(merged.end(), whole.end());
  EXPECT_EQ(merged.delta().position, whole.delta().position);
  EXPECT_EQ(merged.covariance(), whole.covariance());
  EXPECT_THROW(Preintegration::merged(second, first), std::invalid_argument);
}

TEST(Preintegration, WalkGrowsWithTheRootOfTime) {
  Random random(8);
  const auto motion = SimulatedMotion::random(random);
  const Vector6d half = preintegrate(motion, 0.5, 200, {}).walk_sigma();
  const Vector6d two = preintegrate(motion, 2, 200, {}).walk_sigma();
  EXPECT_LT((two - 2 * half).norm(), 1e-12);
  EXPECT_NEAR(half[0], 1.9e-5 * std::sqrt(0.5), 1e-9);
  EXPECT_NEAR(half[3], 3e-3 * std::sqrt(0.5), 1e-9);
}

TEST(Preintegration, RefusesWhatIsNoInterval) {
  EXPECT_THROW(Preintegration({}, {}, simulated_noise()), std::invalid_argument);
  EXPECT_THROW(Preintegration({ImuSample{}}, {}, simulated_noise()), std::invalid_argument);
  EXPECT_THROW(Preintegration({ImuSample{}, ImuSample{}}, {}, simulated_noise()),
               std::invalid_argument);
}

TEST(ImuNoise, InflatesAndRefusesNonsense) {
  const ImuCalibration sensor = {1e-4, 1e-5, 1e-3, 1e-2, 200};
  const ImuNoise noise =
      ImuNoise::of(sensor, {.gyroscope_inflation = 3, .accelerometer_walk_inflation = 2});
  EXPECT_DOUBLE_EQ(noise.gyroscope, 3e-4);
  EXPECT_DOUBLE_EQ(noise.accelerometer_walk, 2e-2);
  EXPECT_DOUBLE_EQ(noise.gyroscope_variance(0.01), 9e-8 / 0.01);
  EXPECT_DOUBLE_EQ(noise.gyroscope_variance(0.1), 0.25);
  EXPECT_THROW(ImuNoise::of({}, {}), InputError);
  EXPECT_THROW(ImuNoise::of(sensor, {.gyroscope_inflation = 0}), InputError);
  EXPECT_THROW(ImuNoise::of(sensor, {.gap = 0}), InputError);
  EXPECT_THROW(ImuNoise::of(sensor, {.gap_acceleration = -1}), InputError);
}

}  // namespace
}  // namespace rover
