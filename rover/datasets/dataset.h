#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "rover/base/timestamp.h"
#include "rover/camera/camera.h"
#include "rover/datasets/trajectory.h"
#include "rover/imu/imu_sample.h"

namespace rover {

// What the sensors gave up to one image stamp.
struct SensorFrame {
  std::int64_t index = 0;  // counts the frames offered, from 0
  Timestamp time = 0;      // strictly increasing
  // One per camera of the rig: 8 bit, one channel, of the calibration's size; empty when the camera
  // has no usable image at this time, and then `problems` says why (camera 0 always) or is empty
  // (no partner was recorded). Pixels are not shared with later frames.
  std::vector<cv::Mat> images;
  std::vector<std::string> problems;
  // All readings after those of the last frame, up to the first one at or after `time` (so that one
  // can interpolate there). The first frame has everything recorded before it.
  std::vector<ImuSample> imu;

  bool usable() const { return !images.empty() && !images.front().empty(); }
};

// A stream of time-ordered sensor events with its calibration. Not thread-safe.
class Dataset {
 public:
  virtual ~Dataset() = default;

  // The cameras whose images next() delivers (one; two where stereo was asked for). The body frame
  // is the inertial sensor's where there is one, else camera 0's: see Rig::in_camera_frame.
  virtual const Rig& rig() const = 0;
  // Nothing unless inertial data were asked for.
  virtual const std::optional<ImuCalibration>& imu_calibration() const = 0;
  // Frames offered. For a video it is the container's own estimate.
  virtual std::size_t size() const = 0;
  // Poses of the rig's body frame in any fixed world frame; empty if there are none.
  virtual const Trajectory& ground_truth() const = 0;
  // What was left out on opening and why, one line each, for the user to read.
  virtual const std::vector<std::string>& notes() const = 0;

  // The next frame, in time order; nothing at the end. A frame whose image cannot be used is
  // delivered without it.
  virtual std::optional<SensorFrame> next() = 0;
};

enum class DatasetFormat { kAuto, kEuroc, kTum, kKitti, kFolder, kVideo };

// "auto", "euroc" (and TUM-VI), "tum", "kitti", "folder", "video". Throws InputError for others.
DatasetFormat parse_dataset_format(const std::string& name);

struct DatasetOptions {
  std::filesystem::path path;  // a folder, or a video file
  DatasetFormat format = DatasetFormat::kAuto;
  // EuRoC sensor.yaml or Kalibr camchain.yaml; needed for plain folders and videos, else it
  // replaces the dataset's own.
  std::optional<std::filesystem::path> calibration;
  // EuRoC imu0/sensor.yaml or Kalibr imu.yaml; replaces the dataset's own.
  std::optional<std::filesystem::path> imu_calibration;
  bool stereo = false;    // deliver camera 1 as well; an error if there is none
  bool inertial = false;  // deliver inertial data; an error if there are none
  double frame_rate = 0;  // Hz, for folders whose file names are no time stamps, and videos;
                          // 0: the video's own, else 30
  int read_ahead = 2;     // images decoded ahead on a thread of their own; 0: none

  void check() const;
};

// Throws InputError for anything that makes the whole dataset unusable. Single lines, stamps or
// images that are bad are left out and described.
std::unique_ptr<Dataset> open_dataset(const DatasetOptions& options);

// The same stream, with up to `depth` (at least 1) frames read ahead on a thread of its own, which
// begins at the first next().
std::unique_ptr<Dataset> read_ahead(std::unique_ptr<Dataset> dataset, int depth);

}  // namespace rover
