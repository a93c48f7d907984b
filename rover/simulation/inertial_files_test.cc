#include "rover/simulation/inertial_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/datasets/dataset.h"
#include "rover/datasets/test_folder.h"
#include "rover/datasets/text_rows.h"
#include "rover/simulation/test_motion.h"

namespace rover {
namespace {

constexpr Timestamp kEpoch = 1'500'000'000'000'000'000;

class InertialFiles : public ::testing::Test {
 protected:
  InertialFiles() {
    folder.write("mav0/cam0/data.csv", "1500000000000000000,a.png\n1500000001500000000,b.png\n");
    folder.write("mav0/cam0/sensor.yaml",
                 "T_BS: {rows: 4, cols: 4, data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}\n"
                 "resolution: [32, 24]\ncamera_model: pinhole\nintrinsics: [20, 20, 16, 12]\n"
                 "distortion_model: none\n");
    folder.write_image("mav0/cam0/data/a.png", 32, 24);
    folder.write_image("mav0/cam0/data/b.png", 32, 24);
    for (const char* name : {"imu0", "state_groundtruth_estimate0"}) {
      std::filesystem::create_directory(folder / "mav0" / name);
    }
    write_imu_folder(folder / "mav0/imu0", recording, euroc_imu_calibration());
    write_ground_truth_folder(folder / "mav0/state_groundtruth_estimate0", motion, kEpoch,
                              recording);
  }

  TestFolder folder;
  SplineMotion motion = random_motion(0, 0.1, 20, 1);  // 1.5 s
  ImuRecording recording = synthesize_imu(motion, kEpoch);
};

TEST_F(InertialFiles, TheReferenceIsOffAsAsked) {
  ReferenceError error;
  error.position = 0.003;
  error.correlation = 0.01;
  write_ground_truth_folder(folder / "mav0/state_groundtruth_estimate0", motion, kEpoch, recording,
                            error);
  DatasetOptions options;
  options.path = folder.path();
  const Trajectory truth = open_dataset(options)->ground_truth();
  double squares = 0;
  for (const StampedPose& pose : truth) {
    const SE3 exact = motion.at(seconds_between(kEpoch, pose.time)).world_from_body;
    squares += (pose.pose.translation - exact.translation).squaredNorm();
  }
  const double rms = std::sqrt(squares / static_cast<double>(truth.size()));
  EXPECT_NEAR(rms, error.position, 0.25 * error.position);  // some 150 independent values
}

TEST_F(InertialFiles, AreReadAsAnEurocSequence) {
  DatasetOptions options;
  options.path = folder.path();
  options.inertial = true;
  const auto dataset = open_dataset(options);
  EXPECT_TRUE(dataset->notes().empty());
  ASSERT_TRUE(dataset->imu_calibration().has_value());
  EXPECT_EQ(dataset->imu_calibration()->gyroscope_noise, 1.6968e-4);
  EXPECT_EQ(dataset->imu_calibration()->gyroscope_walk, 1.9393e-5);
  EXPECT_EQ(dataset->imu_calibration()->accelerometer_noise, 2e-3);
  EXPECT_EQ(dataset->imu_calibration()->accelerometer_walk, 3e-3);
  EXPECT_EQ(dataset->imu_calibration()->rate, 200);
  std::vector<ImuSample> read;
  while (const auto frame = dataset->next()) {
    read.insert(read.end(), frame->imu.begin(), frame->imu.end());
  }
  ASSERT_EQ(read.size(), recording.samples.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].time, recording.samples[i].time);
    EXPECT_LT((read[i].angular_velocity - recording.samples[i].angular_velocity).norm(), 1e-9);
    EXPECT_LT((read[i].acceleration - recording.samples[i].acceleration).norm(), 1e-9);
  }
  ASSERT_EQ(dataset->ground_truth().size(), read.size());
  for (const StampedPose& stamped : dataset->ground_truth()) {
    const SE3 exact = motion.pose_at(seconds_between(kEpoch, stamped.time));
    EXPECT_LT(se3_minus(stamped.pose, exact).norm(), 5e-9);
  }
}

TEST_F(InertialFiles, GroundTruthHoldsVelocityAndBiases) {
  const std::string text = read_text_file(folder / "mav0/state_groundtruth_estimate0/data.csv");
  const auto rows = split_rows(text, ',');
  ASSERT_EQ(rows.size(), recording.samples.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].fields.size(), 17U);
    const auto vector_at = [&](std::size_t column) {
      return Eigen::Vector3d(parse_number(rows[i].fields[column]),
                             parse_number(rows[i].fields[column + 1]),
                             parse_number(rows[i].fields[column + 2]));
    };
    const MotionState state = motion.at(static_cast<double>(i) * 0.005);
    EXPECT_LT((vector_at(8) - state.velocity).norm(), 1e-8);
    EXPECT_LT((vector_at(11) - recording.biases[i].gyroscope).norm(), 1e-8);
    EXPECT_LT((vector_at(14) - recording.biases[i].accelerometer).norm(), 1e-8);
  }
}

TEST_F(InertialFiles, RefuseFoldersThatAreNotThere) {
  EXPECT_THAT(input_error_of(
                  [&] { write_imu_folder(folder / "none", recording, euroc_imu_calibration()); }),
              ::testing::HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace rover
