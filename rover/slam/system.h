#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "rover/camera/camera.h"
#include "rover/map/map.h"
#include "rover/slam/config.h"
#include "rover/slam/final_trajectory.h"
#include "rover/slam/mode.h"
#include "rover/tracking/tracking_result.h"

namespace rover {

// What mapping did with one keyframe.
struct MappingRecord {
  KeyframeId keyframe;
  FrameId frame;
  Timestamp time = 0;  // of that frame
  int lag_frames = 0;  // frames offered between the keyframe and the end of its mapping
  MappingReport report;
};

// The SLAM system: images in, poses out, a map behind. One thread at a time may call it; in
// concurrent execution mapping runs on a thread of its own.
//
//   rover::System slam(rover::Config(), rig, rover::Mode::kMono);
//   auto result = slam.add_images(time, image);   // result.state, result.world_from_body, ...
//   slam.finish();
class System {
 public:
  // The body frame is the rig's: in inertial modes the inertial sensor's, whose calibration they
  // need. mask: 8 bit, camera 0's size, no features where it is 0; or empty. Throws InputError for
  // options that make no sense, a rig that cannot serve the mode, and models that are missing.
  System(const Config& config, const Rig& rig, Mode mode, const cv::Mat& mask = {},
         const std::optional<ImuCalibration>& imu = {});
  ~System();
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  // Takes a reading of the inertial sensor (inertial modes; else it is left aside). Before each
  // frame those up to imu_needed() of its stamp, and if possible the one after, should be in.
  // False: left out, as it is out of order or not finite.
  bool add_imu(const ImuSample& sample);
  // The stamp that readings should have reached before a frame is given: the frame's own, or later
  // where the inertial sensor's clock is ahead of the camera's, or may turn out to be.
  Timestamp imu_needed(Timestamp image) const;

  // Tracks the next frame. time: ns; a frame that is not later than the one before is left out, and
  // the result says so. Images: 8 bit, one channel, of the calibration's size; `right` may be empty
  // in stereo (the frame is used as mono). Throws InputError otherwise.
  TrackingResult add_images(Timestamp time, const cv::Mat& left, const cv::Mat& right = {});

  // Waits until mapping has done all it was given.
  void finish();

  // Adjusts the whole of the map with most frames, with inertial data where it is aligned. Returns
  // ms taken; 0 without a map.
  double adjust_largest_map();

  // Forgets everything, as if just made.
  void reset();

  // Maps begun so far, as they are now.
  std::vector<std::shared_ptr<const Map>> maps() const;
  // The map with most tracked frames; nothing before the first one.
  std::optional<MapId> largest_map() const;
  // Every frame placed in a map, through the map as it is now, in time order.
  std::vector<FinalPose> trajectory(MapId map) const;
  std::vector<FinalPose> keyframes(MapId map) const;
  // Where mapping is, since the last call.
  std::vector<MappingRecord> take_mapping_records();
  const Config& config() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace rover
