#include "rover/datasets/calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/datasets/test_folder.h"
#include "rover/datasets/test_sequences.h"

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  if (at == std::string::npos) throw std::logic_error(what + " is not in the text");
  return text.replace(at, what.size(), by);
}

RigCalibration read_rig(const std::string& yaml) {
  const TestFolder folder;
  folder.write("camera.yaml", yaml);
  return read_rig_calibration(folder / "camera.yaml");
}

std::string rig_error(const std::string& yaml) {
  return input_error_of([&] { read_rig(yaml); });
}

TEST(Calibration, ReadsEurocSensors) {
  const auto [rig, body_is_imu] = read_rig(camera_yaml(64, 48, 0.25));
  EXPECT_TRUE(body_is_imu);
  ASSERT_EQ(rig.size(), 1);
  EXPECT_EQ(rig.cameras[0].width(), 64);
  EXPECT_EQ(rig.cameras[0].height(), 48);
  EXPECT_EQ(rig.cameras[0].model(), CameraModel::kPinhole);
  EXPECT_EQ(rig.cameras[0].distortion()[0], -0.28);
  EXPECT_EQ(rig.cameras[0].distortion()[3], 1.8e-05);
  EXPECT_EQ(rig.body_from_camera[0].translation.x(), 0.25);
}

TEST(Calibration, ReadsKalibrChains) {
  const auto [rig, body_is_imu] = read_rig(kCamchain);
  EXPECT_TRUE(body_is_imu);
  ASSERT_EQ(rig.size(), 2);
  EXPECT_NEAR(rig.body_from_camera[0].translation.x(), -0.01, 1e-12);
  EXPECT_NEAR(rig.body_from_camera[1].translation.x(), 0.09, 1e-12);
  std::string without = kCamchain;
  without = replaced(without, "T_cam_imu", "T_other");
  EXPECT_FALSE(read_rig(without).body_is_imu);
  EXPECT_NEAR(read_rig(without).rig.body_from_camera[1].translation.x(), 0.1, 1e-12);
}

TEST(Calibration, TakesNoDistortion) {
  const auto yaml = replaced(camera_yaml(64, 48), "radial-tangential", "none");
  EXPECT_EQ(read_rig(yaml).rig.cameras[0].distortion()[0], 0);
}

TEST(Calibration, NamesWhatIsMissing) {
  for (const char* key : {"resolution", "intrinsics", "camera_model", "distortion_model",
                          "distortion_coefficients"}) {
    const auto yaml = replaced(camera_yaml(64, 48), key, "unknown");
    EXPECT_THAT(rig_error(yaml), AllOf(HasSubstr(key), HasSubstr("camera.yaml")));
  }
  EXPECT_THAT(rig_error(replaced(kCamchain, "T_cn_cnm1", "unknown")), HasSubstr("cam1.T_cn_cnm1"));
}

TEST(Calibration, RefusesValuesThatMakeNoSense) {
  const std::string good = camera_yaml(64, 48);
  EXPECT_THAT(rig_error(replaced(good, "[60.0, 60.0", "[.nan, 60.0")), HasSubstr("intrinsics"));
  EXPECT_THAT(rig_error(replaced(good, "[60.0, 60.0", "[inf, 60.0")), HasSubstr("intrinsics"));
  EXPECT_THAT(rig_error(replaced(good, "[60.0, 60.0", "[60.0")), HasSubstr("intrinsics"));
  EXPECT_THAT(rig_error(replaced(good, "[60.0, 60.0", "[-60.0, 60.0")), HasSubstr("camera.yaml"));
  EXPECT_THAT(rig_error(replaced(good, "[64, 48]", "[64.5, 48]")), HasSubstr("resolution"));
  EXPECT_THAT(rig_error(replaced(good, "[64, 48]", "[0, 48]")), HasSubstr("resolution"));
  EXPECT_THAT(rig_error(replaced(good, "[64, 48]", "{a: b}")), HasSubstr("resolution"));
  EXPECT_THAT(rig_error(replaced(good, "radial-tangential", "fov")), HasSubstr("fov"));
  EXPECT_THAT(rig_error(replaced(good, ": pinhole", ": omni")), HasSubstr("omni"));
  EXPECT_THAT(rig_error(replaced(good, "data: [1.0", "data: [2.0")), HasSubstr("T_BS"));
  EXPECT_THAT(rig_error(replaced(good, "data: [1.0,", "data: [")), HasSubstr("T_BS"));
}

TEST(Calibration, RefusesHalfAFile) {
  const std::string good = camera_yaml(64, 48);
  int refused = 0;
  for (std::size_t size = 0; size + 30 < good.size(); ++size) {
    refused += !rig_error(good.substr(0, size)).empty();
  }
  EXPECT_EQ(refused, static_cast<int>(good.size()) - 30);
  EXPECT_THAT(rig_error("a: [1, 2"), HasSubstr("line 1"));
  EXPECT_THAT(rig_error(std::string(5000, '[')), HasSubstr("YAML"));
}

TEST(Calibration, ReadsNoiseOfTheInertialSensor) {
  const TestFolder folder;
  folder.write("imu.yaml", kImuYaml);
  const auto [imu, body_from_imu] = read_imu_calibration(folder / "imu.yaml");
  EXPECT_EQ(imu.gyroscope_noise, 1.7e-4);
  EXPECT_EQ(imu.gyroscope_walk, 1.9e-5);
  EXPECT_EQ(imu.accelerometer_noise, 2.0e-3);
  EXPECT_EQ(imu.accelerometer_walk, 3.0e-3);
  EXPECT_EQ(imu.rate, 200);
  EXPECT_EQ(body_from_imu.translation, Eigen::Vector3d::Zero());
  const auto error_of = [&](const std::string& text) {
    folder.write("imu.yaml", text);
    return input_error_of([&] { read_imu_calibration(folder / "imu.yaml"); });
  };
  EXPECT_THAT(error_of(replaced(kImuYaml, "1.7e-4", "0")), HasSubstr("gyroscope_noise_density"));
  EXPECT_THAT(error_of(replaced(kImuYaml, "update_rate", "x")), HasSubstr("update_rate"));
}

}  // namespace
}  // namespace rover
