#include "rover/diagnosis/inertial_check.h"

#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/diagnosis/axis_fit.h"
#include "rover/diagnosis/test_findings.h"
#include "rover/diagnosis/visual_motion.h"
#include "rover/imu/real_flights.h"
#include "rover/imu/simulated_motion.h"

namespace rover {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const ImuCalibration kSensor = {1.7e-4, 1.9e-5, 2e-3, 3e-3, 200};

// A visual run of 12 s with the noise of a good one, at a scale that is not metric, and inertial
// data.
class CameraAgainstImu : public ::testing::TestWithParam<int> {
 protected:
  CameraAgainstImu() : random_(static_cast<std::uint64_t>(GetParam())) {
    const auto motion = SimulatedMotion::random(random_);
    const ImuBias bias = {{0.03, -0.02, 0.05}, {0.05, -0.1, 0.08}};
    imu_ = simulate_imu(motion, -1, 13, 200, bias, simulated_noise(5), random_);
    body_from_camera_ = random_rotation(random_);
    const Eigen::Quaterniond world = random_rotation(random_);
    for (double t = 0; t < 12; t += 0.05) {
      const SE3 pose = motion.pose(t);
      camera_.push_back(
          {from_seconds(t),
           {world * pose.rotation * body_from_camera_ *
                so3_exp(0.0007 * random_gaussian_vector(random_)),
            world * (0.3 * pose.translation) + 0.0006 * random_gaussian_vector(random_)}});
    }
  }

  Findings findings() const {
    Findings findings;
    check_camera_against_imu(camera_, body_from_camera_, imu_, findings);
    return findings;
  }
  void turn_axes(const Eigen::Matrix3d& gyroscope, const Eigen::Matrix3d& accelerometer) {
    for (ImuSample& sample : imu_) {
      sample.angular_velocity = gyroscope * sample.angular_velocity;
      sample.acceleration = accelerometer * sample.acceleration;
    }
  }

  Random random_;
  Trajectory camera_;
  std::vector<ImuSample> imu_;
  Eigen::Quaterniond body_from_camera_;
};

INSTANTIATE_TEST_SUITE_P(Seeds, CameraAgainstImu, ::testing::Range(1, 9));

Eigen::Matrix3d swapped_x_and_y() {
  return (Eigen::Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, 1).finished();
}
Eigen::Matrix3d turned_about_z() {
  return (Eigen::Matrix3d() << 0, -1, 0, 1, 0, 0, 0, 0, 1).finished();
}

TEST_P(CameraAgainstImu, FindsNothingWrongWithGoodData) {
  const Findings all = findings();
  EXPECT_THAT(warnings_of(all), IsEmpty());
  EXPECT_NEAR(*find_finding(all, "time_offset").value, 0, 0.003);
  EXPECT_LT(*find_finding(all, "extrinsic_rotation").value, 1);
  EXPECT_GT(*find_finding(all, "gyroscope_axes").value, 0.98);
}

TEST_P(CameraAgainstImu, TellsTheClocksApart) {
  for (StampedPose& pose : camera_) pose.time -= from_seconds(0.012);
  const Findings all = findings();
  EXPECT_THAT(warnings_of(all), ElementsAre("time_offset"));
  EXPECT_NEAR(*find_finding(all, "time_offset").value, 0.012, 0.003);
}

TEST_P(CameraAgainstImu, TellsClocksFarApart) {
  for (StampedPose& pose : camera_) pose.time += from_seconds(0.3);
  EXPECT_NEAR(*find_finding(findings(), "time_offset").value, -0.3, 0.003);
}

TEST_P(CameraAgainstImu, TellsTurnedExtrinsics) {
  body_from_camera_ = body_from_camera_ * so3_exp({0, 0.14, 0});
  const Findings all = findings();
  EXPECT_THAT(warnings_of(all), ElementsAre("extrinsic_rotation"));
  EXPECT_NEAR(*find_finding(all, "extrinsic_rotation").value, 8.0, 1);
}

TEST_P(CameraAgainstImu, TellsAMirroredGyroscope) {
  turn_axes(swapped_x_and_y(), Eigen::Matrix3d::Identity());
  const Findings all = findings();
  EXPECT_THAT(warnings_of(all), ElementsAre("gyroscope_axes"));
  EXPECT_THAT(find_finding(all, "gyroscope_axes").text, HasSubstr("(y, x, z)"));
  EXPECT_THAT(find_finding(all, "gyroscope_axes").advice, HasSubstr("mirrors"));
}

TEST_P(CameraAgainstImu, TellsMixedUpAccelerometerAxes) {
  turn_axes(Eigen::Matrix3d::Identity(), swapped_x_and_y());
  EXPECT_THAT(warnings_of(findings()), ElementsAre("accelerometer_axes"));
}

TEST_P(CameraAgainstImu, TellsASensorMountedOtherwise) {
  turn_axes(turned_about_z(), turned_about_z());
  const Findings all = findings();
  EXPECT_THAT(warnings_of(all), ElementsAre("gyroscope_axes", "accelerometer_axes"));
  EXPECT_THAT(find_finding(all, "gyroscope_axes").text, HasSubstr("(y, -x, z)"));
  EXPECT_THAT(find_finding(all, "accelerometer_axes").text, HasSubstr("(y, -x, z)"));
}

TEST_P(CameraAgainstImu, TellsDegrees) {
  for (ImuSample& sample : imu_) sample.angular_velocity *= 180 / std::numbers::pi;
  const Findings all = findings();
  EXPECT_THAT(warnings_of(all), ElementsAre("gyroscope_scale"));
  EXPECT_THAT(find_finding(all, "gyroscope_scale").advice, HasSubstr("deg/s"));
}

TEST_P(CameraAgainstImu, TellsAnotherRecording) {
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < imu_.size(); ++i) {
    if (i % 40 == 0) turn = 0.3 * random_gaussian_vector(random_);
    imu_[i].angular_velocity = turn;
  }
  EXPECT_THAT(warnings_of(findings()), ElementsAre("rotation_correlation"));
}

TEST_P(CameraAgainstImu, SaysWhenThereIsTooLittleMotion) {
  camera_.resize(20);
  EXPECT_EQ(find_finding(findings(), "rotation_correlation").severity, Severity::kNote);
  camera_.clear();
  EXPECT_EQ(find_finding(findings(), "rotation_correlation").severity, Severity::kNote);
}

// The true motion of real flights in the camera's place: their readings are in order, and stay so
// wherever the sensor is mounted.
TEST(RealFlights, AreInOrderUntilTheirAxesAreMixedUp) {
  if (!std::filesystem::exists(real_flights_folder()))
    GTEST_SKIP() << real_flights_folder() << " is not here";
  for (const std::string& name : real_flight_names()) {
    SCOPED_TRACE(name);
    const RealFlight flight = read_real_flight(name);
    std::vector<ImuSample> imu(flight.imu.samples().begin(), flight.imu.samples().end());
    Trajectory poses;
    std::vector<Timestamp> times;
    for (std::size_t i = 0; i < flight.states.size(); i += 10) {
      times.push_back(flight.times[i]);
      poses.push_back({flight.times[i], flight.states[i].world_from_body});
    }
    const auto span = liveliest_span(times, imu, 12);
    ASSERT_TRUE(span);
    std::erase_if(poses, [&](const StampedPose& pose) {
      return pose.time < span->begin || pose.time > span->end;
    });
    Findings good, swapped;
    check_camera_against_imu(poses, Eigen::Quaterniond::Identity(), imu, good);
    check_inertial_data(imu, euroc_imu(), good);
    EXPECT_THAT(warnings_of(good), IsEmpty());
    for (ImuSample& sample : imu) {
      sample.acceleration = swapped_x_and_y() * sample.acceleration;
      sample.angular_velocity = turned_about_z() * sample.angular_velocity;
    }
    check_camera_against_imu(poses, Eigen::Quaterniond::Identity(), imu, swapped);
    EXPECT_THAT(warnings_of(swapped), ElementsAre("gyroscope_axes", "accelerometer_axes"));
  }
}

TEST(AxisFit, NamesAxes) {
  EXPECT_EQ(describe_axes(Eigen::Matrix3d::Identity()), "(x, y, z)");
  EXPECT_EQ(describe_axes(-swapped_x_and_y()), "(-y, -x, -z)");
}

TEST(InertialData, IsJudgedByItself) {
  Random random(1);
  auto samples = simulate_imu(SimulatedMotion(), 0, 0.995, 200, {{0.01, 0.02, 0.03}, {0, 0, 0}},
                              simulated_noise(), random);
  const auto motion = SimulatedMotion::random(random);
  for (const auto& sample : simulate_imu(motion, 1, 10, 200, {}, simulated_noise(), random))
    samples.push_back(sample);
  Findings good;
  check_inertial_data(samples, kSensor, good);
  EXPECT_THAT(warnings_of(good), IsEmpty());
  EXPECT_NEAR(*find_finding(good, "rest_gravity").value, kGravity, 0.01);
  EXPECT_NEAR(*find_finding(good, "imu_rate").value, 200, 0.1);
  for (ImuSample& sample : samples) sample.acceleration /= kGravity;
  Findings in_g;
  check_inertial_data(samples, kSensor, in_g);
  EXPECT_THAT(warnings_of(in_g), Contains("imu_data"));
  EXPECT_THAT(find_finding(in_g, "imu_data").text, HasSubstr("look like g"));
}

TEST(LiveliestSpan, IsWhereTheBodyTurns) {
  Random random(2);
  const auto motion = SimulatedMotion::random(random);
  auto imu = simulate_imu(SimulatedMotion(), 0, 20, 200, {}, simulated_noise(), random);
  for (ImuSample& sample : imu)
    if (sample.time >= from_seconds(10)) sample = motion.sample(seconds_between(0, sample.time));
  std::vector<Timestamp> images;
  for (int i = 0; i <= 400; ++i) images.push_back(from_seconds(0.05 * i));
  const auto span = liveliest_span(images, imu, 5);
  ASSERT_TRUE(span);
  EXPECT_GE(span->begin, from_seconds(9.9));
  EXPECT_NEAR(seconds_between(span->begin, span->end), 5, 1e-9);
  images.erase(images.begin() + 200, images.begin() + 350);  // 10 s to 17.5 s
  EXPECT_GE(liveliest_span(images, imu, 5)->begin, from_seconds(17.5));
  EXPECT_FALSE(liveliest_span(std::vector<Timestamp>{0, from_seconds(1)}, imu, 5));
}

}  // namespace
}  // namespace rover
