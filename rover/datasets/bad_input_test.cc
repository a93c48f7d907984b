// Every kind of broken dataset: an error that names what is wrong, or a counted omission; never a
// crash.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/datasets/dataset.h"
#include "rover/datasets/test_folder.h"
#include "rover/datasets/test_sequences.h"

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::SizeIs;

class BadInput : public ::testing::Test {
 protected:
  BadInput() { options_.path = folder_.path(); }

  std::string error() {
    return input_error_of([&] { open_dataset(options_); });
  }

  std::vector<SensorFrame> frames() {
    const auto dataset = open_dataset(options_);
    notes_ = dataset->notes();
    std::vector<SensorFrame> all;
    while (auto frame = dataset->next()) all.push_back(*frame);
    return all;
  }

  std::string image(int index) const {
    return fmt::format("mav0/cam0/data/{}.png", euroc_time(index));
  }

  TestFolder folder_;
  DatasetOptions options_;
  std::vector<std::string> notes_;
};

TEST_F(BadInput, FolderIsMissing) {
  options_.path = folder_ / "nothing";
  EXPECT_THAT(error(), AllOf(HasSubstr("nothing"), HasSubstr("no such")));
}

TEST_F(BadInput, FolderIsEmpty) { EXPECT_THAT(error(), HasSubstr("empty")); }

TEST_F(BadInput, FolderHoldsNothingKnown) {
  folder_.write("readme.txt", "hello");
  EXPECT_THAT(error(), AllOf(HasSubstr("rgb.txt"), HasSubstr("mav0")));
  options_.path = folder_ / "readme.txt";
  EXPECT_THAT(error(), HasSubstr("neither a folder nor a video"));
}

TEST_F(BadInput, FormatIsNotTheFolders) {
  write_euroc(folder_);
  options_.format = DatasetFormat::kTum;
  EXPECT_THAT(error(), HasSubstr("freiburg1"));
  options_.format = DatasetFormat::kKitti;
  EXPECT_THAT(error(), HasSubstr("image_0"));
  EXPECT_THAT(input_error_of([] { parse_dataset_format("bag"); }), HasSubstr("euroc"));
}

TEST_F(BadInput, OptionsMakeNoSense) {
  write_euroc(folder_);
  options_.read_ahead = -1;
  EXPECT_THAT(error(), HasSubstr("-1"));
  options_.read_ahead = 0;
  options_.frame_rate = -3;
  EXPECT_THAT(error(), HasSubstr("-3"));
}

TEST_F(BadInput, ListIsMissingOrEmpty) {
  write_euroc(folder_);
  folder_.write("mav0/cam0/data.csv", "#timestamp [ns],filename\n");
  EXPECT_THAT(error(), AllOf(HasSubstr("cam0/data.csv"), HasSubstr("no data")));
  folder_.write("mav0/cam0/data.csv", "");
  EXPECT_THAT(error(), HasSubstr("no data"));
  std::filesystem::remove(folder_ / "mav0/cam0/data.csv");
  EXPECT_THAT(error(), AllOf(HasSubstr("cam0/data.csv"), HasSubstr("no such file")));
}

TEST_F(BadInput, ListHasBrokenLines) {
  write_euroc(folder_);
  folder_.write("mav0/cam0/data.csv",
                euroc_image_list({0, 1, 2, 3}) + "garbage\n" + "17,\n" + "140371");
  EXPECT_THAT(frames(), SizeIs(4));
  EXPECT_THAT(notes_, Contains(AllOf(HasSubstr("data.csv"), HasSubstr("3 of 7 lines"),
                                     HasSubstr("line 6"))));
}

TEST_F(BadInput, ListIsMostlyBroken) {
  write_euroc(folder_);
  folder_.write("mav0/cam0/data.csv", euroc_image_list({0}) + "a\nb\nc\n");
  EXPECT_THAT(error(), AllOf(HasSubstr("data.csv"), HasSubstr("line 3")));
}

TEST_F(BadInput, StampsRepeatOrGoBack) {
  write_euroc(folder_);
  folder_.write("mav0/cam0/data.csv", euroc_image_list({0, 1, 1, 0, 2, 3}));
  EXPECT_THAT(frames(), SizeIs(4));
  EXPECT_THAT(notes_,
              Contains(AllOf(HasSubstr("2 of 6"), HasSubstr("line 4"), HasSubstr("line 3"))));
}

TEST_F(BadInput, EveryStampComesTwice) {
  write_euroc(folder_);
  folder_.write("mav0/cam0/data.csv", euroc_image_list({0, 0, 1, 1, 2, 2, 2, 3, 3}));
  EXPECT_THAT(frames(), SizeIs(4));
  EXPECT_THAT(notes_, Contains(AllOf(HasSubstr("5 of 9"), HasSubstr("line 3"))));
}

TEST_F(BadInput, StampsAreOutOfRange) {
  write_euroc(folder_);
  folder_.write("mav0/cam0/data.csv", euroc_image_list({0, 1}) +
                                          "9223372036854775807,x.png\n"
                                          "-5,x.png\n"
                                          "99999999999999999999999,x.png\n" +
                                          euroc_image_list({2, 3}));
  EXPECT_THAT(frames(), SizeIs(4));
  EXPECT_THAT(notes_, Contains(HasSubstr("3 of 7")));
}

TEST_F(BadInput, ImagesAreUnusable) {
  write_euroc(folder_);
  const std::string whole = folder_.read(image(1));
  folder_.write(image(0), whole.substr(0, whole.size() - 20));
  folder_.write(image(1), "");
  folder_.write_image(image(2), 32, 32);
  std::filesystem::remove(folder_ / image(3));
  const auto all = frames();
  ASSERT_THAT(all, SizeIs(5));
  const char* reasons[] = {"cut off", "empty", "32x32", "missing"};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_FALSE(all[i].usable());
    EXPECT_THAT(all[i].problems[0],
                AllOf(HasSubstr(reasons[i]), HasSubstr(image(static_cast<int>(i)))));
  }
  EXPECT_TRUE(all[4].usable());
  EXPECT_EQ(all[4].problems[0], "");
}

TEST_F(BadInput, ImagesAreNoImages) {
  write_euroc(folder_);
  folder_.write(image(1), "P5 garbage");
  folder_.write(image(2), "hello");
  folder_.write(image(3), std::string("\x89PNG\r\n\x1a\n", 8));
  const auto all = frames();
  EXPECT_THAT(all[1].problems[0], HasSubstr("damaged"));
  EXPECT_THAT(all[2].problems[0], HasSubstr("not a PNG"));
  EXPECT_THAT(all[3].problems[0], HasSubstr("cut off"));
}

TEST_F(BadInput, CalibrationIsOfAnotherSize) {
  write_euroc(folder_);
  folder_.write("mav0/cam0/sensor.yaml", camera_yaml(128, 96));
  EXPECT_THAT(error(), AllOf(HasSubstr("64x48"), HasSubstr("128x96"), HasSubstr("calibration")));
}

TEST_F(BadInput, JpegIsCutOff) {
  const TestFolder pictures;
  pictures.write_image("a.jpg", 64, 48);
  const std::string whole = pictures.read("a.jpg");
  folder_.write("camera.yaml", camera_yaml(64, 48));
  folder_.write("images/1.jpg", whole);
  folder_.write("images/2.jpg", whole.substr(0, whole.size() - 2));
  folder_.write("images/3.jpg", whole.substr(0, whole.size() / 2));
  folder_.write("images/4.jpg", whole + std::string(100, '\0'));  // padding does no harm
  options_.path = folder_ / "images";
  options_.calibration = folder_ / "camera.yaml";
  const auto all = frames();
  ASSERT_THAT(all, SizeIs(4));
  EXPECT_TRUE(all[0].usable());
  EXPECT_THAT(all[1].problems[0], HasSubstr("cut off"));
  EXPECT_THAT(all[2].problems[0], HasSubstr("cut off"));
  EXPECT_TRUE(all[3].usable());
}

TEST_F(BadInput, ModeAsksForWhatIsNotThere) {
  write_euroc(folder_);
  std::filesystem::remove_all(folder_ / "mav0/cam1");
  std::filesystem::remove_all(folder_ / "mav0/imu0");
  options_.stereo = true;
  EXPECT_THAT(error(), HasSubstr("cam1"));
  options_.stereo = false;
  options_.inertial = true;
  EXPECT_THAT(error(), HasSubstr("imu0"));
  write_tum(folder_, "freiburg1");
  options_.path = folder_ / "freiburg1";
  EXPECT_THAT(error(), HasSubstr("inertial"));
  options_.inertial = false;
  options_.stereo = true;
  EXPECT_THAT(error(), HasSubstr("one camera"));
}

TEST_F(BadInput, CalibrationFileHasTooFewCameras) {
  write_euroc(folder_);
  options_.stereo = true;
  options_.calibration = folder_ / "mav0/cam0/sensor.yaml";
  EXPECT_THAT(error(), HasSubstr("holds one camera"));
}

TEST_F(BadInput, InertialDataAreOfAnotherTime) {
  write_euroc(folder_);
  folder_.write("mav0/imu0/data.csv", "1000,0,0,0,0,0,9.81\n2000,0,0,0,0,0,9.81\n");
  options_.inertial = true;
  EXPECT_THAT(error(), HasSubstr("overlap"));
}

TEST_F(BadInput, InertialLinesAreBroken) {
  write_euroc(folder_);
  folder_.write("mav0/imu0/data.csv",
                euroc_imu_list() + "1403715299999999999,nan,0,0,0,0,9.81\n14037153,1,2\n");
  options_.inertial = true;
  EXPECT_THAT(frames(), SizeIs(5));
  EXPECT_THAT(notes_, Contains(AllOf(HasSubstr("imu0"), HasSubstr("2 of 83"),
                                     HasSubstr("'nan' is not a number"))));
}

TEST_F(BadInput, KittiFilesAreIncomplete) {
  write_kitti(folder_);
  folder_.write("times.txt", "0.0\nx\n0.2\n0.3\n");
  auto all = frames();
  ASSERT_THAT(all, SizeIs(3));
  EXPECT_EQ(all[1].time, 200'000'000);
  EXPECT_TRUE(all[1].usable());
  EXPECT_THAT(all[2].problems[0], HasSubstr("no image"));
  folder_.write("calib.txt", "P0: 1 2 3\n");
  EXPECT_THAT(error(), AllOf(HasSubstr("calib.txt"), HasSubstr("line 1")));
  folder_.write("calib.txt", "P1: 1 2 3\n");
  EXPECT_THAT(error(), HasSubstr("'P0:' is missing"));
}

TEST_F(BadInput, KittiBaselineIsMissing) {
  write_kitti(folder_);
  folder_.write("calib.txt",
                "P0: 700 0 60 0 0 700 18 0 0 0 1 0\nP1: 700 0 60 0 0 700 18 0 0 0 1 0\n");
  options_.stereo = true;
  EXPECT_THAT(error(), HasSubstr("to the right"));
}

TEST_F(BadInput, VideoIsNone) {
  folder_.write("clip.mp4", "not a video");
  options_.path = folder_ / "clip.mp4";
  EXPECT_THAT(error(), HasSubstr("--calibration"));
  folder_.write("camera.yaml", camera_yaml(64, 48));
  options_.calibration = folder_ / "camera.yaml";
  EXPECT_THAT(error(), HasSubstr("decoded"));
}

}  // namespace
}  // namespace rover
