#include "rover/datasets/dataset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/videoio.hpp>

#include "rover/datasets/test_folder.h"
#include "rover/datasets/test_sequences.h"

namespace rover {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::vector<SensorFrame> read_all(Dataset& dataset) {
  std::vector<SensorFrame> frames;
  while (auto frame = dataset.next()) frames.push_back(*frame);
  return frames;
}

DatasetOptions options_for(const TestFolder& folder) {
  DatasetOptions options;
  options.path = folder.path();
  return options;
}

std::string error_of(const DatasetOptions& options) {
  return input_error_of([&] { open_dataset(options); });
}

TEST(Euroc, DeliversStereoFramesWithInertialData) {
  TestFolder folder;
  write_euroc(folder);
  auto options = options_for(folder);
  options.stereo = options.inertial = true;
  const auto dataset = open_dataset(options);
  EXPECT_THAT(dataset->notes(), IsEmpty());
  EXPECT_EQ(dataset->size(), 5u);
  ASSERT_EQ(dataset->rig().size(), 2);
  EXPECT_NEAR(dataset->rig().baseline(), 0.1, 1e-12);
  EXPECT_EQ(dataset->imu_calibration()->rate, 200);
  ASSERT_THAT(dataset->ground_truth(), SizeIs(5));
  EXPECT_EQ(dataset->ground_truth()[2].pose.translation, Eigen::Vector3d(2, 0, 0));
  EXPECT_EQ(dataset->ground_truth()[2].pose.rotation.w(), 1);
  const auto frames = read_all(*dataset);
  ASSERT_THAT(frames, SizeIs(5));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].index, static_cast<std::int64_t>(i));
    EXPECT_EQ(frames[i].time, euroc_time(static_cast<int>(i)));
    ASSERT_THAT(frames[i].images, SizeIs(2));
    for (const auto& image : frames[i].images) {
      EXPECT_EQ(image.type(), CV_8UC1);
      EXPECT_EQ(image.size(), cv::Size(64, 48));
    }
  }
}

TEST(Euroc, DeliversEachInertialSampleOnceAndCoversTheFrame) {
  TestFolder folder;
  write_euroc(folder);
  auto options = options_for(folder);
  options.inertial = true;
  const auto frames = read_all(*open_dataset(options));
  Timestamp last = 0;
  for (const SensorFrame& frame : frames) {
    for (const ImuSample& sample : frame.imu) {
      EXPECT_LT(last, sample.time);
      last = sample.time;
    }
    EXPECT_GE(last, frame.time);
    EXPECT_LT(last, frame.time + 5'000'000);  // no more than the one that closes the interval
  }
  // 0.1 s of inertial data lie before the first image, at 200 Hz.
  EXPECT_THAT(frames[0].imu, SizeIs(21));
  EXPECT_EQ(frames[0].imu[0].acceleration, Eigen::Vector3d(0, 0, 9.81));
  EXPECT_EQ(frames[0].imu[0].angular_velocity, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_THAT(frames[1].imu, SizeIs(10));
}

TEST(Euroc, UsesAnImageWithoutPartnerAsMono) {
  TestFolder folder;
  write_euroc(folder);
  folder.write("mav0/cam1/data.csv", euroc_image_list({0, 1, 3, 4}));
  auto options = options_for(folder);
  options.stereo = true;
  const auto dataset = open_dataset(options);
  EXPECT_THAT(dataset->notes(), Contains(HasSubstr("4 of 5 left and 4 right")));
  const auto frames = read_all(*dataset);
  ASSERT_THAT(frames, SizeIs(5));
  EXPECT_TRUE(frames[2].usable());
  EXPECT_TRUE(frames[2].images[1].empty());
  EXPECT_EQ(frames[2].problems[1], "");
  EXPECT_FALSE(frames[3].images[1].empty());
}

TEST(Euroc, MakesTheInertialSensorTheBody) {
  TestFolder folder;
  write_euroc(folder);
  const auto yaml = folder.read("mav0/imu0/sensor.yaml");
  folder.write("mav0/imu0/sensor.yaml",
               yaml + "T_BS: {rows: 4, cols: 4, data: [1,0,0,2, 0,1,0,0, 0,0,1,0, 0,0,0,1]}\n");
  auto options = options_for(folder);
  options.inertial = true;
  const auto dataset = open_dataset(options);
  EXPECT_NEAR(dataset->rig().body_from_camera[0].translation.x(), -2, 1e-12);
  EXPECT_NEAR(dataset->ground_truth()[0].pose.translation.x(), 2, 1e-12);
}

TEST(Euroc, ReadsTheTumViLayout) {
  TestFolder folder;
  write_euroc(folder);
  for (const char* name :
       {"mav0/cam0/sensor.yaml", "mav0/cam1/sensor.yaml", "mav0/imu0/sensor.yaml"}) {
    std::filesystem::remove(folder / name);
  }
  std::filesystem::rename(folder / "mav0/state_groundtruth_estimate0", folder / "mav0/mocap0");
  folder.write("dso/camchain.yaml", kCamchain);
  folder.write("dso/imu_config.yaml", kImuYaml);
  auto options = options_for(folder);
  options.stereo = options.inertial = true;
  const auto dataset = open_dataset(options);
  EXPECT_EQ(dataset->rig().cameras[0].model(), CameraModel::kFisheye);
  EXPECT_NEAR(dataset->rig().baseline(), 0.1, 1e-9);
  EXPECT_THAT(dataset->ground_truth(), SizeIs(5));
}

TEST(Tum, KnowsTheCamerasOfTheBenchmark) {
  TestFolder folder;
  write_tum(folder, "freiburg2_desk");
  DatasetOptions options;
  options.path = folder / "freiburg2_desk";
  const auto dataset = open_dataset(options);
  EXPECT_EQ(dataset->rig().cameras[0].intrinsics()[0], 520.9);
  EXPECT_EQ(dataset->rig().cameras[0].distortion()[4], 0.9172);
  const auto frames = read_all(*dataset);
  ASSERT_THAT(frames, SizeIs(3));
  EXPECT_EQ(frames[1].time, 1305031102211214000);
  EXPECT_THAT(dataset->ground_truth(), SizeIs(2));
}

TEST(Tum, AsksForTheCalibrationOfUnknownCameras) {
  TestFolder folder;
  write_tum(folder, "kitchen");
  DatasetOptions options;
  options.path = folder / "kitchen";
  EXPECT_THAT(error_of(options), HasSubstr("--calibration"));
  folder.write("camera.yaml", camera_yaml(640, 480));
  options.calibration = folder / "camera.yaml";
  EXPECT_EQ(open_dataset(options)->size(), 3u);
}

TEST(Kitti, DeliversStereoWithBaselineAndGroundTruth) {
  TestFolder folder;
  write_kitti(folder);
  auto options = options_for(folder);
  options.stereo = true;
  const auto dataset = open_dataset(options);
  EXPECT_NEAR(dataset->rig().baseline(), 386.1448 / 718.856, 1e-9);
  EXPECT_NEAR(dataset->rig().body_from_camera[1].translation.x(), 0.53716, 1e-4);
  const auto frames = read_all(*dataset);
  ASSERT_THAT(frames, SizeIs(3));
  EXPECT_EQ(frames[1].time, 103735900);
  ASSERT_THAT(dataset->ground_truth(), SizeIs(3));
  EXPECT_EQ(dataset->ground_truth()[1].time, 103735900);
  EXPECT_NEAR(dataset->ground_truth()[2].pose.translation.z(), 2, 1e-12);
}

TEST(Kitti, FindsTheBenchmarksOwnPlaceOfPoses) {
  TestFolder folder;
  write_kitti(folder, "sequences/07/");
  std::filesystem::create_directories(folder / "poses");
  std::filesystem::rename(folder / "sequences/07/poses.txt", folder / "poses/07.txt");
  DatasetOptions options;
  options.path = folder / "sequences/07";
  EXPECT_THAT(open_dataset(options)->ground_truth(), SizeIs(3));
  options.path = folder / "sequences/07/";
  EXPECT_THAT(open_dataset(options)->ground_truth(), SizeIs(3));
}

TEST(Folder, TakesStampsFromFileNames) {
  TestFolder folder;
  folder.write("camera.yaml", camera_yaml(64, 48));
  folder.write_image("ns/1403715285312143104.png", 64, 48);
  folder.write_image("ns/1403715285262142976.png", 64, 48);
  folder.write_image("seconds/1305031102.175304.png", 64, 48);
  folder.write_image("count/image9.png", 64, 48);
  folder.write_image("count/image10.png", 64, 48, 200);
  DatasetOptions options;
  options.calibration = folder / "camera.yaml";
  options.path = folder / "ns";
  EXPECT_EQ(read_all(*open_dataset(options))[0].time, 1403715285262142976);
  options.path = folder / "seconds";
  EXPECT_EQ(read_all(*open_dataset(options))[0].time, 1305031102175304000);
  options.path = folder / "count";
  EXPECT_THAT(open_dataset(options)->notes(), Contains(HasSubstr("30 Hz is assumed")));
  options.frame_rate = 10;
  const auto frames = read_all(*open_dataset(options));
  ASSERT_THAT(frames, SizeIs(2));
  EXPECT_EQ(frames[1].time, 100'000'000);
  EXPECT_GT(frames[1].images[0].at<unsigned char>(0, 0), 150);
}

TEST(Folder, NeedsACalibration) {
  TestFolder folder;
  folder.write_image("1.png", 64, 48);
  EXPECT_THAT(error_of(options_for(folder)), HasSubstr("--calibration"));
}

TEST(Video, IsReadAtItsOwnRateOrTheGivenOne) {
  TestFolder folder;
  folder.write("camera.yaml", camera_yaml(64, 48));
  const auto file = folder / "clip.avi";
  {
    cv::VideoWriter writer(file.string(), cv::CAP_OPENCV_MJPEG,
                           cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25, cv::Size(64, 48));
    for (int i = 0; i < 4; ++i) writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(60 * i)));
  }
  DatasetOptions options;
  options.path = file;
  options.calibration = folder / "camera.yaml";
  const auto frames = read_all(*open_dataset(options));
  ASSERT_THAT(frames, SizeIs(4));
  EXPECT_EQ(frames[3].time, 120'000'000);
  EXPECT_EQ(frames[3].images[0].type(), CV_8UC1);
  EXPECT_NEAR(frames[3].images[0].at<unsigned char>(24, 32), 180, 6);
  EXPECT_NEAR(frames[1].images[0].at<unsigned char>(24, 32), 60, 6);  // pixels are its own
  options.frame_rate = 10;
  EXPECT_EQ(read_all(*open_dataset(options))[3].time, 300'000'000);
  folder.write("camera.yaml", camera_yaml(32, 48));
  EXPECT_THAT(error_of(options), HasSubstr("64x48"));
}

TEST(Dataset, RebasesTheRigToCameraZero) {
  TestFolder folder;
  write_euroc(folder);
  auto options = options_for(folder);
  options.stereo = true;
  const Rig rig = open_dataset(options)->rig();
  const Rig rebased = rig.in_camera_frame();
  EXPECT_EQ(rebased.body_from_camera[0].translation, Eigen::Vector3d::Zero());
  const SE3 expected = rig.body_from_camera[0].inverse() * rig.body_from_camera[1];
  EXPECT_LT((rebased.body_from_camera[1].matrix() - expected.matrix()).norm(), 1e-12);
}

TEST(ReadAhead, DeliversTheSameFramesAndStopsEarly) {
  TestFolder folder;
  write_euroc(folder);
  auto options = options_for(folder);
  options.inertial = true;
  std::vector<std::vector<SensorFrame>> runs;
  for (int depth : {0, 1, 3}) {
    options.read_ahead = depth;
    runs.push_back(read_all(*open_dataset(options)));
  }
  for (std::size_t run = 1; run < runs.size(); ++run) {
    ASSERT_EQ(runs[run].size(), runs[0].size());
    for (std::size_t i = 0; i < runs[0].size(); ++i) {
      EXPECT_EQ(runs[run][i].time, runs[0][i].time);
      EXPECT_EQ(runs[run][i].imu.size(), runs[0][i].imu.size());
      EXPECT_EQ(cv::norm(runs[run][i].images[0], runs[0][i].images[0], cv::NORM_INF), 0);
    }
  }
  const auto dataset = open_dataset(options);
  EXPECT_TRUE(dataset->next());  // destroyed with frames still waiting
}

// A stream that fails after its first frame.
class FailingDataset : public Dataset {
 public:
  const Rig& rig() const override { return rig_; }
  const std::optional<ImuCalibration>& imu_calibration() const override { return imu_; }
  std::size_t size() const override { return 2; }
  const Trajectory& ground_truth() const override { return trajectory_; }
  const std::vector<std::string>& notes() const override { return notes_; }
  std::optional<SensorFrame> next() override {
    if (count_++ > 0) throw InputError("the disk is gone");
    return SensorFrame{};
  }

 private:
  int count_ = 0;
  Rig rig_;
  std::optional<ImuCalibration> imu_;
  Trajectory trajectory_;
  std::vector<std::string> notes_;
};

TEST(ReadAhead, PassesErrorsOn) {
  const auto dataset = read_ahead(std::make_unique<FailingDataset>(), 2);
  EXPECT_TRUE(dataset->next());
  EXPECT_EQ(input_error_of([&] { dataset->next(); }), "the disk is gone");
}

}  // namespace
}  // namespace rover
