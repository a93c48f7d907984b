#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rover/cli/sample_frames.h"
#include "rover/cli/states_csv.h"
#include "rover/datasets/trajectory.h"
#include "rover/slam/system.h"

namespace rover {

// One line of frames.csv.
struct FrameRecord {
  std::int64_t index = 0;
  Timestamp time = 0;
  std::string state;  // waiting, ok, dead-reckoning, lost; skipped (image unusable), dropped (late)
  std::int64_t map = -1;
  int epoch = 0;
  std::int64_t reference = -1;
  int features = 0;
  int matches = 0;
  int inliers = 0;
  double total_ms = 0;  // decoded image in to pose out
  double rss_mb = 0;    // memory of the process, sampled now and then
};

// Collects what a run gives, frame by frame, and writes the files of the output contract (DESIGN,
// section 1).
class RunRecorder {
 public:
  void add(std::int64_t index, const TrackingResult& result, double total_ms);
  void add_unusable(std::int64_t index, Timestamp time, const std::string& state);
  // For the pictures of the report: the image of the frame last added.
  void add_sample(const cv::Mat& image, const TrackingResult& result, const System& system) {
    samples_.offer(image, result, system);
  }
  void add_mapping(std::vector<MappingRecord> records);

  const std::vector<FrameRecord>& frames() const { return frames_; }
  const std::vector<MappingRecord>& mapping() const { return mapping_; }
  int count(const std::string& state) const;
  int lost_events() const;

  // trajectory_causal.txt, trajectory_odometry.txt, frames.csv, timing.csv, covariance.csv,
  // samples/ and, in inertial modes, states.csv.
  void write(const std::filesystem::path& folder) const;

  // Stage name -> all its times in ms.
  std::vector<std::pair<std::string, std::vector<double>>> stages() const;

 private:
  std::string frames_csv() const;
  std::string timing_csv() const;
  std::string covariance_csv() const;

  std::vector<FrameRecord> frames_;
  std::vector<std::pair<std::int64_t, StageTimes>> times_;
  std::vector<MappingRecord> mapping_;
  std::vector<std::pair<Timestamp, Matrix6d>> covariances_;
  std::vector<StateRecord> states_;
  Trajectory causal_;
  Trajectory odometry_;
  SampleFrames samples_;
  double rss_mb_ = 0;
};

}  // namespace rover
