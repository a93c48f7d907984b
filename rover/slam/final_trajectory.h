#pragma once

#include <map>
#include <span>
#include <vector>

#include "rover/map/map.h"
#include "rover/tracking/tracking_result.h"

namespace rover {

// A pose of the finished map.
struct FinalPose {
  FrameId frame;
  Timestamp time = 0;
  SE3 world_from_body;
};

// A frame that tracking placed in a map.
struct PlacedFrame {
  AnchoredPose anchored;
  Matrix6d covariance = Matrix6d::Zero();  // (translation, rotation), body frame, given the map, in
                                           // its units then; zero: unknown
};

// How a frame that became a keyframe was tracked: the motion since the frame before.
struct TrackedMotion {
  SE3 last_from_body;
  MapUnits units;  // of the map then
};

// The poses of all frames placed in a map, through the map as it is now, in time order. Keyframes
// are where the map has them. A frame between two keyframes follows that which it was anchored to;
// what tracking had drifted by when it came to the next keyframe is now known, and is spread over
// the frames on the way, in proportion to time; then inertial data between them have their say.
std::vector<FinalPose> final_trajectory(const Map& map, std::span<const PlacedFrame> placed,
                                        const std::map<FrameId, TrackedMotion>& keyframes);

}  // namespace rover
