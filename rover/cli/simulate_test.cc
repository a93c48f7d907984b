#include <algorithm>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/cli/program.h"
#include "rover/datasets/test_folder.h"
#include "rover/datasets/test_sequences.h"
#include "rover/datasets/trajectory.h"

namespace rover {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Simulate : public ::testing::Test {
 protected:
  Simulate() { folder_.write("sensor.yaml", camera_yaml(64, 48)); }

  // Exit status of `rover simulate --output FOLDER/out ...`; the message goes to error_.
  int simulate(const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"rover", "simulate", "--output", path("out")};
    if (std::count(more.begin(), more.end(), "--rig") == 0) {
      arguments.insert(arguments.end(), {"--rig", path("sensor.yaml")});
    }
    arguments.insert(arguments.end(), more.begin(), more.end());
    std::vector<const char*> argv;
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int status = run_program(static_cast<int>(argv.size()), argv.data());
    testing::internal::GetCapturedStdout();
    error_ = testing::internal::GetCapturedStderr();
    return status;
  }
  void expect_refused(const std::vector<std::string>& options, const std::string& part) {
    EXPECT_EQ(simulate(options), 2);
    EXPECT_THAT(error_, AllOf(StartsWith("rover: "), HasSubstr(part)));
    EXPECT_EQ(std::count(error_.begin(), error_.end(), '\n'), 1) << error_;
    EXPECT_FALSE(fs::exists(path("out")));
    EXPECT_FALSE(fs::exists(path("out.partial")));
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  TestFolder folder_;
  std::string error_;
};

TEST_F(Simulate, WritesASequenceThatIsReadBack) {
  EXPECT_EQ(simulate({"--duration", "1", "--rate", "5", "--texture", "low"}), 0) << error_;
  EXPECT_THAT(folder_.read("out/mav0/cam0/data.csv"), HasSubstr("1700000001000000000.png"));
  EXPECT_TRUE(fs::exists(path("out/mav0/cam0/data/1700000001000000000.png")));
  EXPECT_TRUE(fs::exists(path("render-cache")));
  EXPECT_FALSE(fs::exists(path("out.partial")));
  EXPECT_EQ(simulate({}), 2);
  EXPECT_THAT(error_, HasSubstr("--overwrite"));
}

TEST_F(Simulate, RendersOneLapForAll) {
  EXPECT_EQ(simulate({"--duration", "10", "--rate", "1", "--texture", "low", "--laps", "3"}), 0)
      << error_;
  const auto count = [&](const std::string& folder) {
    return std::distance(fs::directory_iterator(path(folder)), fs::directory_iterator());
  };
  EXPECT_EQ(count("out/mav0/cam0/data"), 31);
  EXPECT_EQ(count("render-cache"), 10);
  // The view is the same, the noise is not.
  const auto image = [&](int second) {
    return folder_.read(fmt::format("out/mav0/cam0/data/17000000{:02}000000000.png", second));
  };
  EXPECT_NE(image(4), image(14));
  EXPECT_NE(image(4), image(5));
}

TEST_F(Simulate, FliesARealWayFaster) {
  std::string truth = "#timestamp\n";
  for (int i = 0; i < 400; ++i) {
    const double t = 0.02 * i;
    truth += fmt::format("{},{},{},1,1,0,0,0\n", static_cast<std::int64_t>(t * 1e9 + 0.5),
                         std::sin(t), std::cos(t));
  }
  folder_.write("truth.csv", truth);
  EXPECT_EQ(simulate({"--along", path("truth.csv"), "--speed", "2", "--duration", "3", "--rate",
                      "2", "--texture", "low"}),
            0)
      << error_;
  const Trajectory flown =
      read_euroc_trajectory(path("out/mav0/state_groundtruth_estimate0/data.csv"));
  EXPECT_NEAR(seconds_between(flown.front().time, flown.back().time), 3, 0.01);
  double way = 0;
  for (std::size_t i = 1; i < flown.size(); ++i) {
    way += (flown[i].pose.translation - flown[i - 1].pose.translation).norm();
  }
  EXPECT_NEAR(way, 6, 0.05);  // at 2 m/s instead of 1
}

TEST_F(Simulate, RefusesUnknownChoices) {
  expect_refused({"--scene", "moon"}, "moon");
  expect_refused({"--lighting", "candle"}, "candle");
  expect_refused({"--texture", "fair"}, "fair");
  expect_refused({"--motion", "drunk"}, "drunk");
  expect_refused({"--preset", "thesis"}, "thesis");
  expect_refused({"--samples", "0"}, "--samples");
  expect_refused({"--exposure", "0"}, "--exposure");
  expect_refused({"--duration", "-3"}, "--duration");
  expect_refused({"--rate", "0"}, "--rate");
  expect_refused({"--moving-objects", "-1"}, "--moving-objects");
  expect_refused({"--calibration-error", "9"}, "--calibration-error");
  expect_refused({"--real-imu"}, "--along");
  expect_refused({"--speed", "2"}, "--along");
  expect_refused({"--speed", "0", "--along", "x"}, "--speed");
  expect_refused({"--speed", "2", "--along", "x", "--real-imu"}, "--synthetic-imu");
  expect_refused({"--laps", "-1"}, "--laps");
  expect_refused({"--laps", "2", "--along", "x"}, "--along");
  expect_refused({"--laps", "2", "--moving-objects", "1"}, "--moving-objects");
  expect_refused({"--laps", "2", "--duration", "10.01", "--rate", "7"}, "whole number");
}

TEST_F(Simulate, RefusesFilesThatCannotServe) {
  expect_refused({"--along", path("nothing.csv")}, "nothing.csv");
  std::string truth = "#timestamp\n";
  for (int i = 0; i < 10; ++i) truth += fmt::format("{},{},0,0,1,0,0,0\n", euroc_time(i), 0.1 * i);
  folder_.write("short.csv", truth);
  expect_refused({"--along", path("short.csv")}, "too short");
  folder_.write("noise.csv", "a,b,c\nd,e,f\n");
  expect_refused({"--along", path("noise.csv")}, "noise.csv");
  fs::create_directory(path("empty"));
  expect_refused({"--textures", path("empty")}, "no usable image");
  folder_.write("odd/sensor.yaml", camera_yaml(65, 48));
  expect_refused({"--rig", path("odd")}, "65 x 48");
}

}  // namespace
}  // namespace rover
