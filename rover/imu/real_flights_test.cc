// The model of the inertial sensor against the world: real inertial data preintegrated between true
// states (docs/inertial.md has the table that this prints).
#include "rover/imu/real_flights.h"

#include <algorithm>
#include <cstdio>

#include <gtest/gtest.h>

#include "rover/base/quantile.h"
#include "rover/imu/imu_check.h"
#include "rover/imu/preintegration.h"

namespace rover {
namespace {

// Ground-truth states whose spacing is right, and what the data between them say.
struct Interval {
  std::size_t from = 0, to = 0;
  Preintegration motion;
};

std::vector<Interval> intervals_of(const RealFlight& flight, int states_apart) {
  std::vector<Interval> intervals;
  const ImuNoise noise = ImuNoise::of(euroc_imu(), {});
  const auto step = static_cast<std::size_t>(states_apart);
  for (std::size_t i = 0; i + step < flight.times.size(); i += step) {
    const auto samples = flight.imu.between(flight.times[i], flight.times[i + step]);
    if (samples.empty()) continue;
    Interval interval = {i, i + step, {samples, flight.states[i].bias, noise}};
    const double expected = 0.005 * states_apart;
    if (interval.motion.longest_step() < 0.02 &&
        std::abs(interval.motion.duration() - expected) < 0.01)
      intervals.push_back(interval);
  }
  return intervals;
}

// True change minus the preintegrated one: (position, rotation, velocity).
Vector9d residual(const RealFlight& flight, const Interval& interval) {
  const InertialState& from = flight.states[interval.from];
  const InertialState predicted = interval.motion.predict(from, gravity_of_z_up());
  const Vector15d error = state_minus(flight.states[interval.to], predicted);
  Vector9d result;
  const Eigen::Quaterniond to_begin = interval.motion.delta().rotation;
  result << to_begin * error.head<3>(), error.segment<3>(3),
      from.world_from_body.rotation.conjugate() * error.segment<3>(6);
  return result;
}

struct Figures {
  Eigen::Vector3d ratio;  // seen by stated deviation of position, rotation, velocity
  Vector9d bias;          // mean by its own standard deviation
};

// The deviation is a robust one (of the median): the ground truth itself jumps in places.
Figures measure(const RealFlight& flight, const std::vector<Interval>& intervals) {
  Vector9d sum = Vector9d::Zero(), squares = Vector9d::Zero();
  std::vector<std::vector<double>> magnitudes(9);
  for (const Interval& interval : intervals) {
    const Vector9d error = residual(flight, interval);
    const Vector9d stated = interval.motion.covariance().diagonal().cwiseSqrt();
    sum += error;
    squares += error.cwiseAbs2();
    for (int k = 0; k < 9; ++k) magnitudes[k].push_back(std::abs(error[k]) / stated[k]);
  }
  Figures figures;
  for (int part = 0; part < 3; ++part) {
    figures.ratio[part] = 0;
    for (int k = 0; k < 3; ++k)
      figures.ratio[part] += 1.4826 / 3 * median(magnitudes[3 * part + k]);
  }
  figures.bias = sum.cwiseQuotient(squares.cwiseSqrt());
  return figures;
}

class RealFlights : public ::testing::TestWithParam<std::string> {};

TEST_P(RealFlights, ResidualsAreWithinTheStatedNoise) {
  if (!std::filesystem::exists(real_flights_folder() / GetParam()))
    GTEST_SKIP() << real_flights_folder() << " is not here";
  const RealFlight flight = read_real_flight(GetParam());
  for (const int apart : {50, 100}) {
    const auto intervals = intervals_of(flight, apart);
    ASSERT_GT(intervals.size(), 100u);
    const Figures figures = measure(flight, intervals);
    std::printf("%-15s %.2f s %4zu: seen/stated p %.2f R %.2f v %.2f, worst mean %.1f sigma\n",
                GetParam().c_str(), 0.005 * apart, intervals.size(), figures.ratio[0],
                figures.ratio[1], figures.ratio[2], figures.bias.cwiseAbs().maxCoeff());
    // The rotations of the MH flights' ground truth were made from the same gyroscope: they tell
    // nothing about the least noise to expect.
    const bool independent = GetParam()[0] == 'V';
    for (int part = 0; part < 3; ++part) {
      EXPECT_LT(figures.ratio[part], 2) << part;
      if (part != 1 || independent) {
        EXPECT_GT(figures.ratio[part], 0.4) << part;
      }
    }
    EXPECT_LT(figures.bias.cwiseAbs().maxCoeff(), 4);
  }
}

TEST_P(RealFlights, PassTheChecks) {
  if (!std::filesystem::exists(real_flights_folder() / GetParam()))
    GTEST_SKIP() << real_flights_folder() << " is not here";
  const RealFlight flight = read_real_flight(GetParam());
  const std::vector<ImuSample> samples(flight.imu.samples().begin(), flight.imu.samples().end());
  const ImuCalibration sensor = euroc_imu();
  const auto report = check_imu(samples, &sensor, {});
  EXPECT_NEAR(report.rate, 200, 1);
  EXPECT_NEAR(report.median_acceleration, kGravity, 0.8);
  EXPECT_EQ(report.not_finite + report.out_of_order, 0);
  for (const auto& warning : report.warnings) {
    EXPECT_EQ(warning.find("look like"), std::string::npos) << warning;
  }
}

INSTANTIATE_TEST_SUITE_P(Euroc, RealFlights, ::testing::ValuesIn(real_flight_names()));

}  // namespace
}  // namespace rover
