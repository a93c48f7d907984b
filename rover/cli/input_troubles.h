#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "rover/datasets/dataset.h"
#include "rover/tracking/tracking_result.h"

namespace rover {

// A time of which inertial data say nothing.
struct ImuGap {
  Timestamp begin = 0;
  double length = 0;  // s
};

// Watches what a sequence delivers for what it does not: images missing, repeated or late, gaps in
// the inertial data, and times without vision.
class InputTroubles {
 public:
  // min_imu_gap: s between samples, see ImuNoiseOptions::gap.
  explicit InputTroubles(double min_imu_gap) : min_imu_gap_(min_imu_gap) {}

  void offer(const SensorFrame& frame);
  void refuse_sample() { ++refused_samples_; }
  // What became of the frame offered; a line to be said at once, or nothing.
  std::string hear(const TrackingResult& result);

  // A line for each kind of trouble, with counts.
  std::vector<std::string> lines() const;
  nlohmann::ordered_json describe() const;

 private:
  int missing_images() const;
  std::vector<ImuGap> imu_gaps() const;
  // s from the last sample to the last image, where that is a gap; else 0.
  double silent_end() const;

  double min_imu_gap_;
  std::vector<Timestamp> images_;
  std::vector<Timestamp> samples_;
  std::vector<VisionGap> vision_gaps_;
  int refused_samples_ = 0;
  int repeated_ = 0;
  int left_out_ = 0;
};

}  // namespace rover
