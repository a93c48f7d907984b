#include "rover/diagnosis/dataset_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "rover/base/random.h"
#include "rover/datasets/test_sequences.h"
#include "rover/diagnosis/calibration_check.h"
#include "rover/diagnosis/clock_check.h"
#include "rover/diagnosis/image_check.h"
#include "rover/diagnosis/test_findings.h"

namespace rover {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Camera camera(double fx, double fy, double cx, double k1 = -0.28) {
  return {CameraModel::kPinhole, 752, 480, {fx, fy, cx, 248}, {k1, 0.07, 0, 0}};
}

Findings of_calibration(const Camera& left, const Eigen::Vector3d& right_place) {
  Findings findings;
  const Rig rig = {{left, left}, {SE3(), {Eigen::Quaterniond::Identity(), right_place}}};
  check_calibration(rig, true, findings);
  return findings;
}

TEST(CalibrationCheck, TakesGoodOnesAndNamesTheirFigures) {
  const Findings good = of_calibration(camera(458, 457, 367), {0.11, 0, 0});
  EXPECT_EQ(worst_of(good), Severity::kOk);
  EXPECT_NEAR(*find_finding(good, "field_of_view_0").value, 90, 12);
  EXPECT_THAT(find_finding(good, "baseline").text, HasSubstr("0.1100 m to the right"));
  EXPECT_THAT(find_finding(good, "baseline").text, HasSubstr("not rectified"));
}

TEST(CalibrationCheck, NamesWhatMakesNoSense) {
  EXPECT_THAT(warnings_of(of_calibration(camera(458, 380, 367), {0.11, 0, 0})),
              ElementsAre("focal_ratio_0", "focal_ratio_1"));
  EXPECT_THAT(warnings_of(of_calibration(camera(458, 457, 183), {0.11, 0, 0})),
              ElementsAre("principal_point_0", "principal_point_1"));
  EXPECT_THAT(warnings_of(of_calibration(camera(4580, 4570, 367), {0.11, 0, 0})),
              ElementsAre("field_of_view_0", "field_of_view_1"));
  EXPECT_THAT(warnings_of(of_calibration(camera(458, 457, 367), {110, 0, 0})),
              ElementsAre("baseline"));
  EXPECT_THAT(warnings_of(of_calibration(camera(458, 457, 367, -0.9), {0.11, 0, 0})),
              Contains("distortion_0"));
}

// 10 s at 20 Hz with inertial data.
DatasetSurvey good_survey() {
  DatasetSurvey survey;
  survey.rig = {{camera(458, 457, 367), camera(458, 457, 367)}, {SE3(), SE3()}};
  survey.missing = {0, 0};
  for (int i = 0; i < 200; ++i) survey.times.push_back(euroc_time(i));
  for (int i = -20; i < 2000; ++i) {
    ImuSample sample;
    sample.time = euroc_time(0) + i * Timestamp{5'000'000};
    survey.imu.push_back(sample);
  }
  return survey;
}

Findings of_clocks(const DatasetSurvey& survey) {
  Findings findings;
  check_clocks(survey, findings);
  return findings;
}

TEST(ClockCheck, TakesGoodStamps) {
  const Findings findings = of_clocks(good_survey());
  EXPECT_EQ(worst_of(findings), Severity::kOk);
  EXPECT_NEAR(*find_finding(findings, "image_rate").value, 20, 1e-6);
}

TEST(ClockCheck, NamesGapsAndJitter) {
  DatasetSurvey one = good_survey();
  one.times.erase(one.times.begin() + 100);
  EXPECT_EQ(find_finding(of_clocks(one), "image_gaps").severity, Severity::kNote);
  DatasetSurvey long_gap = good_survey();
  long_gap.times.erase(long_gap.times.begin() + 100, long_gap.times.begin() + 120);
  EXPECT_THAT(warnings_of(of_clocks(long_gap)), ElementsAre("image_gaps"));
  EXPECT_NEAR(*find_finding(of_clocks(long_gap), "image_gaps").value, 1.05, 1e-6);
  DatasetSurvey shaky = good_survey();
  Random random(1);
  for (Timestamp& time : shaky.times) time += from_seconds(random.uniform(0, 0.02));
  EXPECT_EQ(find_finding(of_clocks(shaky), "image_jitter").severity, Severity::kNote);
}

TEST(ClockCheck, NamesWhatIsMissing) {
  DatasetSurvey survey = good_survey();
  survey.missing[1] = 50;
  survey.imu.resize(1000);
  survey.image_problems = {"one.png: cannot be read"};
  survey.notes = {"data.csv: 3 of 200 lines left out"};
  EXPECT_THAT(warnings_of(of_clocks(survey)),
              ElementsAre("reader", "unreadable_images", "missing_partners", "imu_coverage"));
}

cv::Mat texture() {
  cv::Mat blocks(15, 20, CV_8UC1), image;
  cv::RNG(1).fill(blocks, cv::RNG::UNIFORM, 40, 216);
  cv::resize(blocks, image, {}, 8, 8, cv::INTER_NEAREST);
  return image;
}

TEST(ImageFigures, TellExposureAndBlur) {
  const ImageFigures sharp = figures_of(texture());
  EXPECT_NEAR(sharp.brightness, 128, 12);
  EXPECT_EQ(sharp.dark, 0);
  EXPECT_LT(sharp.blur, 0.3);
  cv::Mat soft;
  cv::GaussianBlur(texture(), soft, {}, 5);
  EXPECT_GT(figures_of(soft).blur, 0.75);
  EXPECT_EQ(figures_of(cv::Mat(32, 32, CV_8UC1, cv::Scalar(255))).bright, 1);
  EXPECT_EQ(figures_of(cv::Mat(32, 32, CV_8UC1, cv::Scalar(3))).dark, 1);
  EXPECT_EQ(figures_of(cv::Mat(32, 32, CV_8UC1, cv::Scalar(3))).blur, 1);
}

TEST(ImageCheck, NamesBadExposure) {
  const std::vector<SampledFrame> samples = {{0, {cv::Mat(64, 64, CV_8UC1, cv::Scalar(255))}}};
  Findings findings;
  check_images(samples, {{FeatureSet()}}, findings);
  EXPECT_THAT(warnings_of(findings), ElementsAre("exposure_0", "blur_0", "features_0"));
}

TEST(DatasetCheck, SeesWhichSensorsThereAre) {
  const TestFolder folder;
  write_euroc(folder);
  write_kitti(folder, "kitti/");
  DatasetOptions input;
  input.path = folder.path();
  EXPECT_TRUE(with_all_sensors(input).stereo);
  EXPECT_TRUE(with_all_sensors(input).inertial);
  input.path = folder / "kitti";
  EXPECT_TRUE(with_all_sensors(input).stereo);
  EXPECT_FALSE(with_all_sensors(input).inertial);
}

TEST(DatasetCheck, RefusesOptionsThatMakeNoSense) {
  EXPECT_THROW(check_dataset({}, {.samples = 0}), InputError);
  EXPECT_THROW(check_dataset({}, {.visual_run = 0}), InputError);
  EXPECT_THROW(check_dataset({}, {.features = 3}), InputError);
  EXPECT_THROW(check_dataset({}, {.threads = 0}), InputError);
  EXPECT_THROW(check_dataset({}, {}), InputError);
}

}  // namespace
}  // namespace rover
