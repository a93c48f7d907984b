#include "rover/optimization/camera_imu_alignment.h"

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/imu/real_flights.h"
#include "rover/imu/simulated_motion.h"

namespace rover {
namespace {

struct Recording {
  Eigen::Quaterniond body_from_camera;
  std::vector<StampedRotation> rotations;
  ImuBuffer imu;
};

// 12 s of motion; the camera's stamps are `offset` seconds behind.
Recording record(double offset, const Eigen::Quaterniond& body_from_camera, Random& random) {
  Recording recording;
  recording.body_from_camera = body_from_camera;
  const auto motion = SimulatedMotion::random(random);
  const ImuBias bias = {{0.03, -0.02, 0.05}, {0, 0, 0}};
  for (const auto& sample : simulate_imu(motion, 0, 12, 200, bias, simulated_noise(5), random))
    recording.imu.add(sample);
  const Eigen::Quaterniond anywhere = random_rotation(random);
  for (double t = 0.5; t < 11.5; t += 0.05) {
    const Eigen::Quaterniond noise = so3_exp(0.001 * random_gaussian_vector(random));
    recording.rotations.push_back(
        {from_seconds(t - offset), anywhere * motion.pose(t).rotation * body_from_camera * noise});
  }
  return recording;
}

TEST(CameraImuAlignment, FindsOffsetAndExtrinsics) {
  Random random(1);
  for (const double offset : {0.0, 0.0123, -0.06}) {
    for (int i = 0; i < 5; ++i) {
      const auto recording = record(offset, random_rotation(random), random);
      const auto found = align_camera_to_imu(recording.rotations, recording.imu, {});
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->time_offset, offset, 5 * found->time_sigma);
      EXPECT_LT(found->time_sigma, 0.005);
      EXPECT_LT(found->body_from_camera.angularDistance(recording.body_from_camera),
                6 * found->rotation_sigma);
      EXPECT_LT(found->rotation_sigma, 0.008);
      EXPECT_NEAR(found->gyroscope_bias.z(), 0.05, 0.003);
    }
  }
}

TEST(CameraImuAlignment, NeedsRotationAboutTwoAxes) {
  Random random(2);
  Recording recording = record(0, Eigen::Quaterniond::Identity(), random);
  SimulatedMotion yaw;
  yaw.angles[2] = {0.5, 2, 0};
  recording.imu = {};
  recording.rotations.clear();
  for (const auto& sample : simulate_imu(yaw, 0, 12, 200, {}, {}, random))
    recording.imu.add(sample);
  for (double t = 0.5; t < 11.5; t += 0.05)
    recording.rotations.push_back({from_seconds(t), yaw.pose(t).rotation});
  EXPECT_FALSE(align_camera_to_imu(recording.rotations, recording.imu, {}));
  EXPECT_FALSE(align_camera_to_imu({}, recording.imu, {}));
  EXPECT_FALSE(align_camera_to_imu(recording.rotations, {}, {}));
}

TEST(CameraImuAlignment, RefusesOptionsThatMakeNoSense) {
  EXPECT_THROW(align_camera_to_imu({}, {}, {.max_offset = 0}), InputError);
  EXPECT_THROW(align_camera_to_imu({}, {}, {.interval = 0}), InputError);
  EXPECT_THROW(align_camera_to_imu({}, {}, {.iterations = 0}), InputError);
}

TEST(CameraImuAlignment, RealFlightsAreInOrder) {
  if (!std::filesystem::exists(real_flights_folder()))
    GTEST_SKIP() << real_flights_folder() << " is not here";
  for (const char* name : {"V1_02_medium", "V1_03_difficult", "V2_02_medium"}) {
    const RealFlight flight = read_real_flight(name);
    std::vector<StampedRotation> rotations;
    for (std::size_t i = 2000; i < 12000; i += 10)
      rotations.push_back({flight.times[i] - 20'000'000,
                           flight.states[i].world_from_body.rotation * so3_exp({0, 0, 0.1})});
    const auto found = align_camera_to_imu(rotations, flight.imu, {});
    ASSERT_TRUE(found);
    std::printf("%s: 20 ms found as %.2f +- %.2f ms, 100 mrad as %.1f mrad\n", name,
                1e3 * found->time_offset, 1e3 * found->time_sigma,
                1e3 * found->body_from_camera.angularDistance(Eigen::Quaterniond::Identity()));
    EXPECT_NEAR(found->time_offset, 0.02, 0.003);
    EXPECT_NEAR(so3_log(found->body_from_camera).z(), 0.1, 0.01);
  }
}

}  // namespace
}  // namespace rover
