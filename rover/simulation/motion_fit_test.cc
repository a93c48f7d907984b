#include "rover/simulation/motion_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/datasets/imu_file.h"
#include "rover/datasets/test_folder.h"
#include "rover/geometry/random_geometry.h"
#include "rover/simulation/flight.h"

namespace rover {
namespace {

using ::testing::HasSubstr;

constexpr Timestamp kEpoch = 1'500'000'000'000'000'000;

// A flight as it would be recorded: a motion capture with noise, its own clock and a world that
// stands askew; inertial data with noise, biases and the vibration of an airframe.
struct Recording {
  Recording() {
    for (double t = 1; t <= 29; t += 0.01) {
      const SE3 noise = random_pose(random, 0.0005, 0.001);
      const SE3 pose = SE3(askew, Eigen::Vector3d(5, 6, 7)) * motion.pose_at(t) * noise;
      ground_truth.push_back({kEpoch + from_seconds(t - kOffset), pose});
    }
    for (ImuSample& sample : imu.samples) {
      const double phase = 2 * M_PI * 37 * seconds_between(kEpoch, sample.time);
      sample.acceleration += Eigen::Vector3d(std::sin(phase), std::cos(phase), 0);
      sample.angular_velocity += 0.05 * Eigen::Vector3d(0, std::sin(phase), std::cos(phase));
    }
  }

  // Of the ground truth, from its first time on.
  Trajectory part(double begin, double end) const {
    Trajectory part;
    for (const StampedPose& pose : ground_truth) {
      const double t = seconds_between(ground_truth[0].time, pose.time);
      if (t >= begin && t < end) part.push_back(pose);
    }
    return part;
  }

  static constexpr double kOffset = 0.0043;
  Random random{1};
  SplineMotion motion =
      make_flight({{-3, -3, 0.5}, {3, 3, 2.5}, {}, false, 0}, {30, FlightStyle::kSmooth, 0, {}, 2});
  Eigen::Quaterniond askew = so3_exp({0.01, -0.005, 0.7});
  ImuRecording imu = synthesize_imu(motion, kEpoch);
  Trajectory ground_truth;
};

const Recording& recording() {
  static const Recording instance;
  return instance;
}

std::string error_of(const Trajectory& ground_truth, const std::vector<ImuSample>& imu,
                     const MotionFitOptions& options = {}) {
  return input_error_of([&] { fit_motion(ground_truth, imu, options); });
}

TEST(MotionFit, FindsClocksGravityAndBiases) {
  const Recording& flight = recording();
  const FittedMotion fit = fit_motion(flight.ground_truth, flight.imu.samples);
  EXPECT_NEAR(fit.time_offset, Recording::kOffset, 1e-4);
  EXPECT_NEAR(fit.tilt, std::hypot(0.01, 0.005), 1e-3);
  EXPECT_EQ(fit.origin, flight.ground_truth.front().time);
  EXPECT_NEAR(fit.motion.end(), 28, 0.02);
  const ImuRecording real = real_imu(fit, flight.imu.samples, fit.origin);
  constexpr std::size_t kFirst = 200;  // sample after the first pose
  for (std::size_t i = 400; i + 400 < real.samples.size(); i += 200) {
    ASSERT_EQ(real.samples[i].time, flight.imu.samples[i + kFirst].time);
    const ImuBias &found = real.biases[i], &truth = flight.imu.biases[i + kFirst];
    EXPECT_LT((found.gyroscope - truth.gyroscope).norm(), 1e-3);
    EXPECT_LT((found.accelerometer - truth.accelerometer).norm(), 0.03);
  }
}

TEST(MotionFit, FollowsTheMotionUpright) {
  const Recording& flight = recording();
  const FittedMotion fit = fit_motion(flight.ground_truth, flight.imu.samples);
  // What is left free is a turn about the vertical and a shift.
  const double start = seconds_between(kEpoch, fit.origin);
  const SE3 fit_from_true = fit.motion.pose_at(14) * flight.motion.pose_at(start + 14).inverse();
  EXPECT_LT((fit_from_true.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ()).norm(),
            2e-3);
  for (double t = 0.5; t < 27.5; t += 0.1) {
    const MotionState found = fit.motion.at(t), truth = flight.motion.at(start + t);
    const Vector6d miss = se3_minus(found.world_from_body, fit_from_true * truth.world_from_body);
    EXPECT_LT(miss.head<3>().norm(), 0.002);
    EXPECT_LT(miss.tail<3>().norm(), 0.002);
    EXPECT_LT((found.angular_velocity - truth.angular_velocity).norm(), 0.03);
  }
}

TEST(MotionFit, LeavesVibrationOnly) {
  const Recording& flight = recording();
  const MotionFitResiduals left = fit_motion(flight.ground_truth, flight.imu.samples).residuals;
  EXPECT_LT(left.position, 0.002);
  EXPECT_LT(left.rotation, 0.002);
  EXPECT_NEAR(left.accelerometer, 1, 0.05);
  EXPECT_NEAR(left.gyroscope, 0.05, 0.005);
  EXPECT_LT(left.slow_accelerometer, 0.05);
  EXPECT_LT(left.slow_gyroscope, 0.002);
}

TEST(MotionFit, SaysWhereGroundTruthAndInertialDataAreOfTwoMotions) {
  const Recording& flight = recording();
  Trajectory swaying = flight.ground_truth;
  for (StampedPose& pose : swaying) {
    const double t = seconds_between(swaying[0].time, pose.time);
    if (t > 12 && t < 18) pose.pose.translation.y() += 0.05 * std::sin(2 * M_PI * (t - 12) / 1.5);
  }
  const auto left = fit_motion(flight.ground_truth, flight.imu.samples).residuals;
  const auto apart = fit_motion(swaying, flight.imu.samples).residuals;
  EXPECT_GE(left.worst_accelerometer, left.slow_accelerometer);
  EXPECT_GE(left.worst_gyroscope, left.slow_gyroscope);
  EXPECT_FALSE(left.contradicts());
  EXPECT_GT(apart.worst_accelerometer, 1.3 * apart.slow_accelerometer);
  EXPECT_TRUE(apart.contradicts());
}

TEST(MotionFit, TakesAGroundTruthAlone) {
  const Recording& flight = recording();
  const FittedMotion fit = fit_motion(flight.part(0, 10), {});
  EXPECT_EQ(fit.time_offset, 0);
  EXPECT_EQ(fit.tilt, 0);
  EXPECT_TRUE(fit.biases.empty());
  EXPECT_LT(fit.residuals.position, 0.002);
  EXPECT_EQ(fit.residuals.gyroscope, 0);
  for (const StampedPose& pose : flight.part(1, 9)) {
    const SE3 found = fit.motion.pose_at(seconds_between(fit.origin, pose.time));
    EXPECT_LT(se3_minus(found, pose.pose).norm(), 0.006);
  }
}

TEST(MotionFit, ChoosesTheStretchAskedFor) {
  const Recording& flight = recording();
  MotionFitOptions options;
  options.start = 4;
  options.duration = 5;
  const FittedMotion fit = fit_motion(flight.ground_truth, flight.imu.samples, options);
  EXPECT_EQ(fit.origin, flight.ground_truth[400].time);
  EXPECT_NEAR(fit.motion.end(), 5, 0.02);
}

TEST(MotionFit, RefusesGapsOrCutsAtThem) {
  const Recording& flight = recording();
  Trajectory broken = flight.part(0, 5);
  const Trajectory longer = flight.part(6, 14), last = flight.part(15, 18);
  broken.insert(broken.end(), longer.begin(), longer.end());
  broken.insert(broken.end(), last.begin(), last.end());
  EXPECT_THAT(error_of(broken, flight.imu.samples), HasSubstr("2 gaps"));
  MotionFitOptions options;
  options.cut = true;
  const FittedMotion fit = fit_motion(broken, flight.imu.samples, options);
  EXPECT_EQ(fit.origin, longer.front().time);
  EXPECT_NEAR(fit.motion.end(), 8, 0.02);
}

TEST(MotionFit, RefusesWhatDoesNotSuffice) {
  const Recording& flight = recording();
  const auto& imu = flight.imu.samples;
  EXPECT_THAT(error_of({}, imu), HasSubstr("empty"));
  EXPECT_THAT(error_of(flight.part(0, 1.5), imu), HasSubstr("too short"));
  MotionFitOptions late;
  late.start = 100;
  EXPECT_THAT(error_of(flight.ground_truth, {}, late), HasSubstr("too short"));
  Trajectory elsewhere = flight.ground_truth;
  for (StampedPose& pose : elsewhere) pose.time += from_seconds(1000);
  EXPECT_THAT(error_of(elsewhere, imu), HasSubstr("overlap"));
  std::vector<ImuSample> sparse = {imu.front(), imu.back()};
  EXPECT_THAT(error_of(flight.ground_truth, sparse), HasSubstr("too few"));
  MotionFitOptions bad;
  bad.knot_interval = 0;
  EXPECT_THAT(error_of(flight.ground_truth, imu, bad), HasSubstr("knot"));
}

TEST(RealImu, IsMovedToTheTimeOfTheSequence) {
  const Recording& flight = recording();
  MotionFitOptions options;
  options.duration = 3;
  const FittedMotion fit = fit_motion(flight.ground_truth, flight.imu.samples, options);
  const ImuRecording real = real_imu(fit, flight.imu.samples, kEpoch);
  ASSERT_EQ(real.samples.size(), 600U);
  EXPECT_EQ(real.biases.size(), real.samples.size());
  EXPECT_GE(real.samples.front().time, kEpoch);
  EXPECT_LT(real.samples.front().time, kEpoch + 5'000'000);
  EXPECT_EQ(real.samples[100].time - real.samples[0].time, 500'000'000);
}

// --- real flights -------------------------------------------------------------------------------

struct RealFlight {
  const char *ground_truth, *imu;
  double seconds;         // at least
  double slow_gyroscope;  // bounds of what is left below 5 Hz
  double slow_accelerometer;
};

class RealFlights : public ::testing::TestWithParam<RealFlight> {};

TEST_P(RealFlights, AgreeWithTheirInertialData) {
  const RealFlight& flight = GetParam();
  const auto data = shared_folder() / "data";
  if (!std::filesystem::exists(data / flight.imu)) {
    GTEST_SKIP() << data / flight.imu << " is not here";
  }
  MotionFitOptions options;
  options.cut = true;
  const FittedMotion fit = fit_motion(read_trajectory(data / flight.ground_truth),
                                      read_imu_file(data / flight.imu), options);
  EXPECT_GE(fit.motion.end(), flight.seconds);
  EXPECT_LT(std::abs(fit.time_offset), 0.004);
  EXPECT_LT(fit.tilt, 0.012);
  EXPECT_LT(fit.residuals.position, 0.003);
  EXPECT_LT(fit.residuals.slow_gyroscope, flight.slow_gyroscope);
  EXPECT_LT(fit.residuals.slow_accelerometer, flight.slow_accelerometer);
}

// The ground truth of MH_03 sways by itself 30 s after its begin, and hardly from 70 s on.
TEST(RealFlight, IsToldWhereItsGroundTruthIsOff) {
  const auto folder = shared_folder() / "data/euroc_imu_gt/MH_03_medium";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not here";
  const Trajectory ground_truth = read_trajectory(folder / "groundtruth_tum.txt.gz");
  const std::vector<ImuSample> imu = read_imu_file(folder / "imu0/data.csv.gz");
  EXPECT_TRUE(fit_motion(ground_truth, imu, {.start = 16, .duration = 40}).residuals.contradicts());
  EXPECT_FALSE(
      fit_motion(ground_truth, imu, {.start = 70, .duration = 40}).residuals.contradicts());
}

INSTANTIATE_TEST_SUITE_P(
    Sequences, RealFlights,
    ::testing::Values(RealFlight{"euroc_imu_gt/V1_01_easy/state_groundtruth_estimate0/data.csv.gz",
                                 "euroc_imu_gt/V1_01_easy/imu0/data.csv.gz", 140, 0.003, 0.1},
                      RealFlight{
                          "euroc_imu_gt/V1_02_medium/state_groundtruth_estimate0/data.csv.gz",
                          "euroc_imu_gt/V1_02_medium/imu0/data.csv.gz", 80, 0.004, 0.1},
                      RealFlight{"euroc_imu_gt/MH_03_medium/groundtruth_tum.txt.gz",
                                 "euroc_imu_gt/MH_03_medium/imu0/data.csv.gz", 130, 0.005, 0.25},
                      RealFlight{"tumvi_imu_gt/room1/groundtruth_tum.txt.gz",
                                 "tumvi_imu_gt/room1/imu0.csv.gz", 40, 0.004, 0.03}),
    [](const auto& instance) {
      std::string name = instance.param.ground_truth;  // letters, digits and underscores only
      name = name.substr(name.find('/') + 1);
      name.resize(name.find('/'));
      return name;
    });

}  // namespace
}  // namespace rover
