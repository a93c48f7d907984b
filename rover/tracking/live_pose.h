#pragma once

#include <optional>

#include "rover/tracking/tracking_result.h"

namespace rover {

struct LivePoseOptions {
  // s in which 63% of a correction come in; 0: at once. Without inertial data always at once.
  double settling_time = 0.15;

  void check() const;
};

// Makes the poses for those who steer by them (LivePose) from what tracking says of each frame. A
// pose moves as inertial data feel it move; what vision or an adjustment of the map finds it to be
// off by comes in over a while: a low-pass filter on the correction, exact in what the body does.
class LivePoseFilter {
 public:
  explicit LivePoseFilter(const LivePoseOptions& options) : options_(options) {}

  // The frames that are placed, in order. `felt`: the motion since the last of them by inertial
  // data, without corrections of both its ends; nothing where that is not known.
  LivePose follow(const TrackingResult& result, const std::optional<SE3>& felt);
  // Tracking is lost: the next pose follows no other.
  void interrupt() { last_.reset(); }

 private:
  struct Given {
    Timestamp time = 0;
    MapId map;
    int epoch = 0;
    LivePose pose;
    SE3 odometry_sought;  // the odometry with all corrections
  };
  double share(const Given& last, Timestamp now) const;
  void begin_odometry(const TrackingResult& result);

  LivePoseOptions options_;
  std::optional<Given> last_;
  SE3 odometry_;  // the last one given, losses or not
  bool odometry_begun_ = false;
};

}  // namespace rover
