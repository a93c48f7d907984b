#pragma once

#include <optional>
#include <vector>

#include "rover/base/ids.h"
#include "rover/base/stage_times.h"
#include "rover/base/timestamp.h"
#include "rover/geometry/se3.h"
#include "rover/imu/inertial_state.h"
#include "rover/map/map.h"

namespace rover {

enum class TrackingState { kWaiting, kOk, kDeadReckoning, kLost };

// "waiting", "ok", "dead-reckoning", "lost".
const char* to_string(TrackingState state);

// A pose relative to a keyframe, so that it follows when the map is corrected.
struct AnchoredPose {
  FrameId frame;
  Timestamp time = 0;
  MapId map;
  KeyframeId reference;
  SE3 reference_from_body;
  MapUnits units;  // of the map when it was anchored
};

// A time without vision that inertial data bridged, at its end.
struct VisionGap {
  Timestamp begin = 0;     // of the last frame tracked before it
  Timestamp end = 0;       // of the first one tracked after it
  int frames = 0;          // in between, dead-reckoned
  SE3 reckoned_from_seen;  // at its end: from the pose that dead reckoning gave to vision's
};

// A frame's pose for those who steer by it, at once. It moves as the body does; corrections come in
// over a while (LivePoseOptions). In visual modes they come at once.
struct LivePose {
  SE3 world_from_body;     // steps where epoch or map change, and after a loss
  SE3 odometry_from_body;  // never steps; drifts
};

// What tracking says of one frame.
struct TrackingResult {
  bool placed() const {
    return !left_out && (state == TrackingState::kOk || state == TrackingState::kDeadReckoning);
  }

  TrackingState state = TrackingState::kWaiting;
  // Where the frame was: state ok, or dead reckoning (by inertial data alone).
  AnchoredPose anchored;
  SE3 world_from_body;                     // through the map as it was then
  Matrix6d covariance = Matrix6d::Zero();  // (translation, rotation), body frame, conditional on
                                           // the map
  SE3 last_from_body;  // motion since the last frame that was placed, both seen through the same
                       // map; identity where there is none
  LivePose live;
  bool metric = true;  // inertial modes: the map is aligned (gravity and scale are known)
  std::optional<InertialState> inertial;              // inertial modes, aligned map
  Matrix15d inertial_covariance = Matrix15d::Zero();  // given position and yaw of the map
  Eigen::Matrix4d drift = Eigen::Matrix4d::Zero();    // of the map around it: see drift.h
  int epoch = 0;
  int features = 0;
  int matches = 0;                    // landmarks joined before the last pose adjustment
  int inliers = 0;                    // and after it
  KeyframeId new_keyframe;            // valid: this frame became a keyframe, for mapping
  std::vector<AnchoredPose> earlier;  // frames before, placed now that there is a map
  bool map_begun = false;
  bool left_out = false;  // not later than the frame before, or the same image again: nothing was
                          // done with it
  bool repeated = false;  // the same image again (inertial modes): dead-reckoned or left out
  std::optional<VisionGap> gap;         // inertial modes: one that ends with this frame
  std::vector<AnchoredPose> corrected;  // its frames, as they look from its end
  StageTimes times;
};

}  // namespace rover
