#include "rover/camera/calibration_file.h"

#include <unistd.h>

#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/base/error.h"

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const char* const kEuroc = R"(%YAML:1.0
# General sensor definitions.
sensor_type: camera
comment: VI-Sensor cam0 (MT9M034)

T_BS:
  cols: 4
  rows: 4
  data: [0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975,
         0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768,
        -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949,
         0.0, 0.0, 0.0, 1.0]

rate_hz: 20
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
)";

const char* const kKalibr = R"(cam0:
  T_cam_imu:
  - [0, -1, 0, 0.1]
  - [1, 0, 0, 0.2]
  - [0, 0, 1, 0.3]
  - [0, 0, 0, 1]
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [0.0034823894, 0.00071503484, -0.0020532361, 0.00020293673]
  distortion_model: equidistant
  intrinsics: [190.97847, 190.97330, 254.93170, 256.89744]
  resolution: [512, 512]
  rostopic: /cam0/image_raw
  timeshift_cam_imu: 0.0125
cam1:
  T_cn_cnm1:
  - [1, 0, 0, -0.11]
  - [0, 1, 0, 0]
  - [0, 0, 1, 0]
  - [0, 0, 0, 1]
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0001, 0.00002]
  distortion_model: radtan
  intrinsics: [190, 191, 254, 256]
  resolution: [640, 480]
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string without(const std::string& text, const std::string& line_with) {
  const auto at = text.find(line_with);
  EXPECT_NE(at, std::string::npos) << line_with;
  const auto begin = text.rfind('\n', at) + 1;
  return text.substr(0, begin) + text.substr(text.find('\n', at) + 1);
}

class CalibrationFile : public ::testing::Test {
 protected:
  CalibrationFile() {
    folder_ =
        std::filesystem::temp_directory_path() / ("rover_calibration_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  ~CalibrationFile() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& text, const std::string& name = "sensor.yaml") {
    const auto file = folder_ / name;
    std::ofstream(file) << text;
    return file;
  }

  std::string error_of(const std::string& text) {
    try {
      read_calibration(write(text));
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }

  std::filesystem::path folder_;
};

TEST_F(CalibrationFile, ReadsEuroc) {
  const RigCalibration calibration = read_calibration(write(kEuroc));
  ASSERT_EQ(calibration.rig.size(), 1);
  EXPECT_TRUE(calibration.has_body);
  const Camera& camera = calibration.rig.cameras[0];
  EXPECT_EQ(camera.model(), CameraModel::kPinhole);
  EXPECT_EQ(camera.width(), 752);
  EXPECT_EQ(camera.height(), 480);
  EXPECT_EQ(camera.intrinsics(), (std::array{458.654, 457.296, 367.215, 248.375}));
  EXPECT_EQ(camera.distortion()[3], 1.76187114e-05);
  const SE3& body_from_camera = calibration.rig.body_from_camera[0];
  EXPECT_NEAR(body_from_camera.rotation_matrix()(0, 1), -0.999880929698, 1e-9);
  EXPECT_EQ(body_from_camera.translation.y(), -0.064676986768);
}

TEST_F(CalibrationFile, ReadsARigOfEurocFiles) {
  const std::string second = replaced(kEuroc, "-0.0216401454975", "0.0883598545025");
  const RigCalibration calibration =
      read_calibration(std::vector{write(kEuroc, "0.yaml"), write(second, "1.yaml")});
  ASSERT_EQ(calibration.rig.size(), 2);
  EXPECT_NEAR(calibration.rig.baseline(), 0.11, 1e-12);
  const Rig visual = calibration.rig.in_camera_frame();
  EXPECT_LT((visual.body_from_camera[0].matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-14);
  EXPECT_NEAR(visual.baseline(), 0.11, 1e-12);
}

TEST_F(CalibrationFile, ReadsKalibr) {
  const RigCalibration calibration = read_calibration(write(kKalibr));
  ASSERT_EQ(calibration.rig.size(), 2);
  EXPECT_TRUE(calibration.has_body);
  EXPECT_EQ(calibration.time_offset, (std::vector{0.0125, 0.0}));
  EXPECT_EQ(calibration.rig.cameras[0].model(), CameraModel::kFisheye);
  EXPECT_EQ(calibration.rig.cameras[1].model(), CameraModel::kPinhole);
  EXPECT_EQ(calibration.rig.cameras[1].width(), 640);
  // The body's origin lies at (0.1, 0.2, 0.3) in camera 0, and 0.11 further left in camera 1.
  const auto& poses = calibration.rig.body_from_camera;
  EXPECT_LT((poses[0] * Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 1e-15);
  EXPECT_LT((poses[1] * Eigen::Vector3d(-0.01, 0.2, 0.3)).norm(), 1e-15);
  EXPECT_NEAR(calibration.rig.baseline(), 0.11, 1e-12);
}

TEST_F(CalibrationFile, KalibrWithoutImuPutsTheBodyIntoCameraZero) {
  std::string text = kKalibr;
  for (const char* line : {"T_cam_imu", "[0, -1, 0, 0.1]", "[1, 0, 0, 0.2]", "[0, 0, 1, 0.3]",
                           "[0, 0, 0, 1]", "timeshift"})
    text = without(text, line);
  const RigCalibration calibration = read_calibration(write(text));
  EXPECT_FALSE(calibration.has_body);
  EXPECT_EQ(calibration.rig.body_from_camera[0].matrix(), Eigen::Matrix4d::Identity());
  EXPECT_EQ(calibration.rig.body_from_camera[1].translation.x(), 0.11);
}

TEST_F(CalibrationFile, MissingKeysAreNamed) {
  for (const char* key :
       {"resolution", "camera_model", "intrinsics", "distortion_model", "distortion_coefficients"})
    EXPECT_THAT(error_of(without(kEuroc, key)),
                AllOf(HasSubstr("sensor.yaml:"), HasSubstr(key), HasSubstr("missing")));
  EXPECT_THAT(error_of(without(kKalibr, "  intrinsics")),
              AllOf(HasSubstr("cam0.intrinsics"), HasSubstr("missing")));
}

TEST_F(CalibrationFile, WrongValuesAreNamedWithTheirLine) {
  const auto error = [&](const char* from, const char* to) {
    return error_of(replaced(kEuroc, from, to));
  };
  EXPECT_THAT(error("458.654, ", ""), AllOf(HasSubstr("yaml:17: intrinsics"), HasSubstr("not 3")));
  EXPECT_THAT(error("458.654", ".nan"), HasSubstr("not finite"));
  EXPECT_THAT(error("458.654", "abc"), HasSubstr("numbers only"));
  EXPECT_THAT(error("458.654", "-458.654"), HasSubstr("positive"));
  EXPECT_THAT(error("752, 480", "752.5, 480"), HasSubstr("yaml:15: resolution"));
  EXPECT_THAT(error("752, 480", "752, 0"), HasSubstr("whole pixels"));
  EXPECT_THAT(error("[752, 480]", "752"), HasSubstr("list"));
  EXPECT_THAT(error("pinhole", "omni"), HasSubstr("'omni' is not supported"));
  EXPECT_THAT(error("radial-tangential", "fov"), HasSubstr("'fov' is not known"));
  EXPECT_THAT(error("0.07395907, 0.00019359, ", ""), HasSubstr("at least 4"));
  EXPECT_THAT(error("-0.28340811", "-0.28340811, 1, 1"), HasSubstr("4 or 5"));
}

TEST_F(CalibrationFile, TransformsMustBeRigid) {
  const auto error = [&](const char* from, const char* to) {
    return error_of(replaced(kEuroc, from, to));
  };
  EXPECT_THAT(error("-0.999880929698", "-0.9"),
              AllOf(HasSubstr("T_BS.data"), HasSubstr("rotation")));
  EXPECT_THAT(error("-0.999880929698, 0.00414029679422", "0.999880929698, 0.00414029679422"),
              HasSubstr("rotation"));
  EXPECT_THAT(error("0.0, 0.0, 0.0, 1.0", "0.0, 0.0, 0.0, 2.0"), HasSubstr("last row"));
  EXPECT_THAT(error("0.0, 0.0, 0.0, 1.0", "0.0, 1.0"), HasSubstr("16 numbers"));
  EXPECT_THAT(error_of(replaced(kKalibr, "[1, 0, 0, -0.11]", "[-1, 0, 0, -0.11]")),
              AllOf(HasSubstr("cam1.T_cn_cnm1"), HasSubstr("rotation")));
}

TEST_F(CalibrationFile, RoundedRotationsAreMadeOrthonormal) {
  const RigCalibration calibration = read_calibration(
      write(replaced(replaced(kEuroc, "0.999557249008", "0.9996"), "-0.999880929698", "-0.9999")));
  const Eigen::Matrix3d r = calibration.rig.body_from_camera[0].rotation_matrix();
  EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
}

// A file that was cut anywhere before its last number is refused, never half read.
TEST_F(CalibrationFile, HalfAFileIsRefused) {
  for (const std::string text : {kEuroc, kKalibr})
    for (std::size_t length = 0; length + 4 < text.size(); length += 5) {
      const bool second_camera_begins_later = length <= text.find("cam1:") + 4;
      if (text == kKalibr && second_camera_begins_later && length > text.find("resolution:"))
        continue;  // a whole rig of one camera
      EXPECT_NE(error_of(text.substr(0, length)), "no error") << text.substr(0, length);
    }
}

TEST_F(CalibrationFile, UnreadableFilesAreNamed) {
  try {
    read_calibration(folder_ / "nothing.yaml");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("nothing.yaml"), HasSubstr("cannot be read")));
  }
  EXPECT_THROW(read_calibration(folder_), InputError);
  EXPECT_THAT(error_of("- 1\n- 2\n"), HasSubstr("no keys"));
  EXPECT_THAT(error_of(""), HasSubstr("no keys"));
  EXPECT_THAT(error_of("a: [1, 2"), HasSubstr("not valid YAML"));
  EXPECT_THROW(read_calibration(std::vector<std::filesystem::path>{}), InputError);
}

}  // namespace
}  // namespace rover
