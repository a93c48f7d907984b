#pragma once

#include <vector>

#include "rover/base/ids.h"
#include "rover/base/stage_times.h"
#include "rover/base/timestamp.h"
#include "rover/geometry/se3.h"

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
};

// What tracking says of one frame.
struct TrackingResult {
  TrackingState state = TrackingState::kWaiting;
  AnchoredPose anchored;                   // state ok: where the frame was
  SE3 world_from_body;                     // state ok: through the map as it was then
  Matrix6d covariance = Matrix6d::Zero();  // state ok: (translation, rotation), body frame,
                                           // conditional on the map
  SE3 last_from_body;  // state ok: motion since the last tracked frame, both seen
                       // through the same map; identity where there is none
  int epoch = 0;
  int features = 0;
  int matches = 0;                    // landmarks joined before the last pose adjustment
  int inliers = 0;                    // and after it
  KeyframeId new_keyframe;            // valid: this frame became a keyframe, for mapping
  std::vector<AnchoredPose> earlier;  // frames before, placed now that there is a map
  bool map_begun = false;
  StageTimes times;
};

}  // namespace rover
