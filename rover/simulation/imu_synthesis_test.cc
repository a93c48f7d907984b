#include "rover/simulation/imu_synthesis.h"

#include <cmath>

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/simulation/flight.h"
#include "rover/simulation/test_motion.h"

namespace rover {
namespace {

constexpr Timestamp kEpoch = 1'500'000'000'000'000'000;
using Vectors = std::vector<Eigen::Vector3d>;

// The integral of samples over each step, by the cubic through the four samples around it (at the
// ends by the trapezoid).
Eigen::Vector3d integral_over_step(const Vectors& f, std::size_t i, double dt) {
  if (i == 0 || i + 2 >= f.size()) return 0.5 * dt * (f[i] + f[i + 1]);
  return dt / 24 * (13 * (f[i] + f[i + 1]) - f[i - 1] - f[i + 2]);
}

Vectors integrate(const Vectors& f, const Eigen::Vector3d& start, double dt) {
  Vectors integral = {start};
  for (std::size_t i = 0; i + 1 < f.size(); ++i) {
    integral.push_back(integral.back() + integral_over_step(f, i, dt));
  }
  return integral;
}

// With the second term of the Magnus expansion (coning correction).
std::vector<Eigen::Quaterniond> integrate_rotation(const Vectors& omega,
                                                   const Eigen::Quaterniond& start, double dt) {
  std::vector<Eigen::Quaterniond> rotations = {start};
  for (std::size_t i = 0; i + 1 < omega.size(); ++i) {
    const Eigen::Vector3d coning = dt * dt / 12 * omega[i].cross(omega[i + 1]);
    rotations.push_back(rotations.back() * so3_exp(integral_over_step(omega, i, dt) + coning));
  }
  return rotations;
}

// Where exact readings lead to, starting from the motion's first state.
SE3 dead_reckoning(const Motion& motion, const std::vector<ImuSample>& samples, double dt) {
  Vectors omega;
  for (const ImuSample& sample : samples) omega.push_back(sample.angular_velocity);
  const MotionState start = motion.at(motion.begin());
  const auto rotations = integrate_rotation(omega, start.world_from_body.rotation, dt);
  Vectors acceleration;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    acceleration.push_back(rotations[i] * samples[i].acceleration + gravity_of_z_up());
  }
  const Vectors velocity = integrate(acceleration, start.velocity, dt);
  return {rotations.back(), integrate(velocity, start.world_from_body.translation, dt).back()};
}

ImuSynthesisOptions exact_options() {
  ImuSynthesisOptions options;
  options.noise = false;
  return options;
}

class ExactReadings : public ::testing::TestWithParam<FlightStyle> {};

TEST_P(ExactReadings, LeadBackOntoTheMotion) {
  const FlightVolume volume = {{-3, -3, 0.5}, {3, 3, 2.5}, {}, false, 0};
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const SplineMotion motion = make_flight(volume, {10, GetParam(), 2, SE3(), seed});
    const ImuRecording recording = synthesize_imu(motion, kEpoch, exact_options());
    ASSERT_EQ(recording.samples.size(), 2001U);
    const SE3 reached = dead_reckoning(motion, recording.samples, 0.005);
    const SE3 expected = motion.pose_at(motion.end());
    EXPECT_LT((reached.translation - expected.translation).norm(), 1e-3);
    EXPECT_LT(reached.rotation.angularDistance(expected.rotation), 5e-5);
  }
}

INSTANTIATE_TEST_SUITE_P(Styles, ExactReadings,
                         ::testing::Values(FlightStyle::kSmooth, FlightStyle::kAggressive,
                                           FlightStyle::kShaking, FlightStyle::kHover));

TEST(ImuSynthesis, StampsCountFromTheEpoch) {
  const SplineMotion motion = random_motion(0, 0.1, 20, 1);
  ImuSynthesisOptions options = exact_options();
  options.calibration.rate = 300;
  const ImuRecording recording = synthesize_imu(motion, kEpoch, options);
  ASSERT_EQ(recording.samples.size(), 451U);
  EXPECT_EQ(recording.samples[0].time, kEpoch);
  EXPECT_EQ(recording.samples[1].time, kEpoch + 3'333'333);
  EXPECT_EQ(recording.samples[450].time, kEpoch + 1'500'000'000);
}

TEST(ImuSynthesis, ReadsGravityAtRest) {
  const SE3 lying(so3_exp({M_PI / 2, 0, 0}), Eigen::Vector3d(1, 2, 3));
  const SplineMotion motion(0, 0.5, std::vector<SE3>(10, lying));
  const ImuRecording recording = synthesize_imu(motion, 0, exact_options());
  for (const ImuSample& sample : recording.samples) {
    EXPECT_LT((sample.acceleration - Eigen::Vector3d(0, kGravity, 0)).norm(), 1e-12);
    EXPECT_LT(sample.angular_velocity.norm(), 1e-12);
  }
}

TEST(ImuSynthesis, SameSeedSameData) {
  const SplineMotion motion = random_motion(0, 0.1, 20, 1);
  ImuSynthesisOptions options;
  options.seed = 5;
  const ImuRecording one = synthesize_imu(motion, 0, options);
  const ImuRecording same = synthesize_imu(motion, 0, options);
  options.seed = 6;
  const ImuRecording other = synthesize_imu(motion, 0, options);
  for (std::size_t i = 0; i < one.samples.size(); ++i) {
    EXPECT_EQ(one.samples[i].angular_velocity, same.samples[i].angular_velocity);
    EXPECT_EQ(one.samples[i].acceleration, same.samples[i].acceleration);
    EXPECT_NE(one.samples[i].acceleration, other.samples[i].acceleration);
    EXPECT_NE(one.biases[i].gyroscope, other.biases[i].gyroscope);
  }
}

TEST(ImuSynthesis, BiasesStartAsStated) {
  const SplineMotion motion(0, 0.01, std::vector<SE3>(6));
  double gyroscope = 0, accelerometer = 0;
  constexpr int kRuns = 1000;
  for (int seed = 0; seed < kRuns; ++seed) {
    ImuSynthesisOptions options;
    options.seed = static_cast<std::uint64_t>(seed);
    const ImuRecording recording = synthesize_imu(motion, 0, options);
    gyroscope += recording.biases[0].gyroscope.squaredNorm();
    accelerometer += recording.biases[0].accelerometer.squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(gyroscope / (3 * kRuns)), 0.03, 0.001);
  EXPECT_NEAR(std::sqrt(accelerometer / (3 * kRuns)), 0.05, 0.002);
}

// Overlapping Allan deviation of the three axes together for clusters of `size` samples (IEEE
// standard 952-1997, annex C).
double allan_deviation(const Vectors& values, std::size_t size) {
  Vectors sums = {Eigen::Vector3d::Zero()};
  for (const Eigen::Vector3d& value : values) sums.push_back(sums.back() + value);
  double total = 0;
  const std::size_t count = sums.size() - 2 * size;
  for (std::size_t i = 0; i < count; ++i) {
    total += (sums[i + 2 * size] - 2 * sums[i + size] + sums[i]).squaredNorm();
  }
  return std::sqrt(total / (6 * static_cast<double>(count))) / static_cast<double>(size);
}

// White noise of density N makes N / sqrt(tau), a random walk of density K makes K sqrt(tau / 3).
double expected_deviation(double noise, double walk, double tau) {
  return std::hypot(noise / std::sqrt(tau), walk * std::sqrt(tau / 3));
}

class Noise : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const SplineMotion still(0, 400, std::vector<SE3>(10));  // 2000 s
    for (const ImuSample& sample : synthesize_imu(still, 0).samples) {
      gyroscope.push_back(sample.angular_velocity);
      accelerometer.push_back(sample.acceleration);
    }
  }
  static Vectors gyroscope, accelerometer;
};
Vectors Noise::gyroscope, Noise::accelerometer;

TEST_F(Noise, HasTheDensitiesOfTheCalibration) {
  struct Case {
    double tau, tolerance;  // longer clusters are fewer
  };
  const ImuCalibration imu = euroc_imu_calibration();
  for (const auto& [tau, tolerance] : {Case{0.05, .01}, Case{1, .03}, Case{8, .06}, Case{60, .2}}) {
    const auto size = static_cast<std::size_t>(tau * imu.rate);
    EXPECT_NEAR(allan_deviation(gyroscope, size) /
                    expected_deviation(imu.gyroscope_noise, imu.gyroscope_walk, tau),
                1, tolerance);
    EXPECT_NEAR(allan_deviation(accelerometer, size) /
                    expected_deviation(imu.accelerometer_noise, imu.accelerometer_walk, tau),
                1, tolerance);
  }
}

TEST_F(Noise, IsWhiteOnAShortScaleAndWalksOnALongOne) {
  const auto slope = [](const Vectors& values, std::size_t shorter, std::size_t longer) {
    return std::log(allan_deviation(values, longer) / allan_deviation(values, shorter)) /
           std::log(static_cast<double>(longer) / static_cast<double>(shorter));
  };
  EXPECT_NEAR(slope(gyroscope, 4, 40), -0.5, 0.02);
  EXPECT_NEAR(slope(accelerometer, 2, 10), -0.5, 0.02);
  EXPECT_NEAR(slope(accelerometer, 2000, 12000), 0.5, 0.15);
}

TEST(ImuSynthesis, RefusesBadOptions) {
  ImuSynthesisOptions options;
  options.calibration.rate = 0;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.calibration.gyroscope_noise = -1;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.accelerometer_bias = std::nan("");
  EXPECT_THROW(options.check(), InputError);
}

}  // namespace
}  // namespace rover
