#include "rover/imu/imu_check.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/imu/simulated_motion.h"

namespace rover {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const ImuCalibration kSensor = {1.7e-4, 1.9e-5, 2e-3, 3e-3, 200};

// One second at rest, nine of motion.
std::vector<ImuSample> flight() {
  Random random(1);
  SimulatedMotion still;
  const ImuBias bias = {{0.01, 0.02, 0.03}, {0, 0, 0}};
  auto samples = simulate_imu(still, 0, 0.995, 200, bias, simulated_noise(), random);
  const auto motion = SimulatedMotion::random(random);
  for (const auto& s : simulate_imu(motion, 1, 10, 200, bias, simulated_noise(), random))
    samples.push_back(s);
  return samples;
}

TEST(ImuCheck, FindsNothingWrongWithGoodData) {
  const auto report = check_imu(flight(), &kSensor, {});
  EXPECT_THAT(report.warnings, IsEmpty());
  EXPECT_NEAR(report.rate, 200, 0.1);
  EXPECT_NEAR(report.duration, 10, 0.01);
  ASSERT_TRUE(report.rest);
  EXPECT_LT(seconds_between(0, report.rest->begin), 0.6);
  EXPECT_NEAR(report.rest->gravity, kGravity, 0.01);
  EXPECT_NEAR(report.rest->gyroscope.z(), 0.03, 0.001);
  EXPECT_NEAR(report.rest->gyroscope_density / 1.7e-4, 1, 0.15);
  EXPECT_NEAR(report.rest->accelerometer_density / 2e-3, 1, 0.15);
}

TEST(ImuCheck, NamesWrongUnits) {
  auto in_g = flight();
  for (auto& s : in_g) s.acceleration /= kGravity;
  EXPECT_THAT(check_imu(in_g, nullptr, {}).warnings, Contains(HasSubstr("look like g")));
  auto in_degrees = flight();
  for (auto& s : in_degrees) s.angular_velocity *= 180 / std::numbers::pi;
  EXPECT_THAT(check_imu(in_degrees, nullptr, {}).warnings, Contains(HasSubstr("look like deg/s")));
  auto without_gravity = flight();
  for (auto& s : without_gravity) s.acceleration *= 0.02;
  EXPECT_THAT(check_imu(without_gravity, nullptr, {}).warnings,
              Contains(HasSubstr("far from 9.81")));
}

TEST(ImuCheck, CountsGapsDisorderAndNan) {
  auto samples = flight();
  samples[700].angular_velocity.x() = std::nan("");
  std::swap(samples[500], samples[501]);
  samples.erase(samples.begin() + 1000, samples.begin() + 1100);
  const auto report = check_imu(samples, nullptr, {});
  EXPECT_EQ(report.not_finite, 1);
  EXPECT_EQ(report.out_of_order, 1);
  EXPECT_EQ(report.gaps, 1);
  EXPECT_NEAR(report.longest_gap, 0.505, 1e-6);
  EXPECT_EQ(report.warnings.size(), 3u);
}

TEST(ImuCheck, ComparesWithTheCalibration) {
  ImuCalibration wrong = kSensor;
  wrong.gyroscope_noise /= 100;
  wrong.accelerometer_noise /= 100;
  wrong.rate = 100;
  const auto report = check_imu(flight(), &wrong, {});
  EXPECT_THAT(report.warnings, Contains(HasSubstr("gyroscope's noise")));
  EXPECT_THAT(report.warnings, Contains(HasSubstr("accelerometer's noise")));
  EXPECT_THAT(report.warnings, Contains(HasSubstr("calibration says 100.0 Hz")));
}

TEST(ImuCheck, SurvivesHardlyAnyData) {
  EXPECT_THAT(check_imu({}, &kSensor, {}).warnings, Contains(HasSubstr("too few")));
  const std::vector<ImuSample> same(5);
  EXPECT_THAT(check_imu(same, &kSensor, {}).warnings, Contains(HasSubstr("too few")));
  EXPECT_THROW(check_imu({}, nullptr, {.gap = 0}), InputError);
  EXPECT_THROW(check_imu({}, nullptr, {.rest_window = 0}), InputError);
}

}  // namespace
}  // namespace rover
