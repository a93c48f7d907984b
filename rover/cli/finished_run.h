#pragma once

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "rover/cli/test_program.h"
#include "rover/datasets/dataset.h"
#include "rover/datasets/test_sequences.h"
#include "rover/evaluation/judgement.h"
#include "rover/evaluation/run_folder.h"
#include "rover/networks/runtime.h"

namespace rover {

// Helpers of the tests that run `rover run` from end to end.

namespace fs = std::filesystem;

constexpr const char* kClip = "euroc/V1_01_clip";
constexpr const char* kDesk = "tum_rgbd/freiburg1_xyz";
constexpr const char* kStreet = "kitti/00_first201";

using Arguments = std::vector<std::string>;

inline Outcome call(const Arguments& arguments) { return call_subcommand("run", arguments); }

// Nothing if a test on a sequence can run, else why not.
inline std::string missing(const std::string& sequence) {
  const fs::path folder = shared_folder() / "data" / sequence;
  if (!fs::exists(folder)) return folder.string() + " is not here";
  return have_models() ? "" : "the models are not here; the set-up makes them";
}

#define SKIP_UNLESS_PRESENT(sequence) \
  if (const auto reason = missing(sequence); !reason.empty()) GTEST_SKIP() << reason

// A run on one dataset into a folder of its own.
class FinishedRun {
 public:
  FinishedRun(fs::path dataset, const std::string& mode, const Arguments& more = {})
      : dataset_(std::move(dataset)) {
    Arguments arguments = {"--dataset", dataset_.string(), "--mode",
                           mode,        "--output",        output().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    outcome_ = call(arguments);
    EXPECT_EQ(outcome_.status, 0) << outcome_.err;
  }

  const Outcome& outcome() const { return outcome_; }
  fs::path output() const { return folder_ / "run"; }
  std::string read(const std::string& name) const { return folder_.read("run/" + name); }
  nlohmann::json summary() const { return nlohmann::json::parse(read("summary.json")); }

  // The state of each frame, from frames.csv.
  std::vector<std::string> states() const {
    std::istringstream lines(read("frames.csv"));
    std::string line, index, time, state;
    std::vector<std::string> states;
    std::getline(lines, line);
    while (std::getline(lines, line)) {
      std::istringstream fields(line);
      std::getline(fields, index, ',');
      std::getline(fields, time, ',');
      std::getline(fields, state, ',');
      states.push_back(state);
    }
    return states;
  }

  Judgement judge_file(const std::string& name) const {
    DatasetOptions options;
    options.path = dataset_;
    const auto dataset = open_dataset(options);
    const bool of_body = summary()["pose_frame"] == "body";
    const auto truth =
        of_body ? dataset->ground_truth()
                : move_frame(dataset->ground_truth(), dataset->rig().body_from_camera[0]);
    return judge(name, read_tum_trajectory(output() / name), truth, 0.02,
                 read_run_folder(output()).offered);
  }

 private:
  fs::path dataset_;
  TestFolder folder_;
  Outcome outcome_;
};

inline fs::path sequence_folder(const std::string& sequence) {
  return shared_folder() / "data" / sequence;
}

// A piece of the flight as a dataset of its own, whose images may be replaced.
class FlightPiece {
 public:
  explicit FlightPiece(std::size_t frames) {
    const fs::path source = sequence_folder(kClip) / "mav0" / "cam0";
    fs::create_directories(folder_ / "mav0/cam0/data");
    fs::copy(source / "sensor.yaml", folder_ / "mav0/cam0/sensor.yaml");
    std::vector<fs::path> images;
    for (const auto& entry : fs::directory_iterator(source / "data")) images.push_back(entry);
    std::sort(images.begin(), images.end());
    images.resize(std::min(frames, images.size()));
    std::string list = "#timestamp [ns],filename\n";
    for (const fs::path& image : images) {
      names_.push_back("mav0/cam0/data/" + image.filename().string());
      fs::copy(image, folder_ / names_.back());
      list += image.stem().string() + "," + image.filename().string() + "\n";
    }
    folder_.write("mav0/cam0/data.csv", list);
    fs::copy(sequence_folder(kClip) / "mav0/imu0", folder_ / "mav0/imu0");
  }

  const fs::path& path() const { return folder_.path(); }
  void blacken(std::size_t index) const {
    cv::imwrite((folder_ / names_[index]).string(), cv::Mat(480, 752, CV_8UC1, cv::Scalar(0)));
  }
  // The image before it again.
  void repeat(std::size_t index) const {
    fs::copy_file(folder_ / names_[index - 1], folder_ / names_[index],
                  fs::copy_options::overwrite_existing);
  }
  // The inertial sensor's clock set ahead.
  void delay_imu(Timestamp by) const {
    std::istringstream lines(folder_.read("mav0/imu0/data.csv"));
    std::string text, line;
    while (std::getline(lines, line)) {
      const auto comma = line.find(',');
      const bool is_row = !line.empty() && line[0] != '#' && comma != std::string::npos;
      text += (is_row ? std::to_string(std::stoll(line) + by) + line.substr(comma) : line) + "\n";
    }
    fs::remove(folder_ / "mav0/imu0/data.csv");  // a copy may be read-only
    folder_.write("mav0/imu0/data.csv", text);
  }
  void shrink(std::size_t index) const { folder_.write_image(names_[index], 320, 240); }
  void truncate(std::size_t index, std::size_t bytes) const {
    folder_.write(names_[index], folder_.read(names_[index]).substr(0, bytes));
  }

 private:
  TestFolder folder_;
  std::vector<std::string> names_;
};

}  // namespace rover
