#pragma once

#include <filesystem>
#include <vector>

#include <opencv2/core.hpp>

#include "rover/base/timestamp.h"
#include "rover/camera/camera.h"

namespace rover {

// A sequence in EuRoC's layout that comes into being as a whole: it is written to OUTPUT.partial
// and renamed at the end. What was not finished is removed.
class SequenceWriter {
 public:
  // Throws InputError if the folder exists already, unless `overwrite`, or cannot be written.
  SequenceWriter(std::filesystem::path output, bool overwrite);
  ~SequenceWriter();
  SequenceWriter(const SequenceWriter&) = delete;
  SequenceWriter& operator=(const SequenceWriter&) = delete;

  // A new folder mav0/NAME of the unfinished sequence.
  std::filesystem::path add_folder(const std::string& name);
  // The unfinished sequence itself.
  const std::filesystem::path& folder() const { return partial_; }

  // sensor.yaml and data.csv of each camera; makes its folders. rate: Hz.
  void add_cameras(const Rig& rig, double rate, const std::vector<Timestamp>& times);
  // Thread-safe for different images. Throws InputError if it cannot be written.
  void add_image(int camera, Timestamp time, const cv::Mat& image) const;

  // Puts the sequence in its place, where an old one is replaced.
  void finish();

 private:
  std::filesystem::path output_, partial_;
  bool finished_ = false;
};

}  // namespace rover
