#pragma once

#include <memory>
#include <vector>

#include "rover/geometry/sim3.h"
#include "rover/imu/preintegration.h"
#include "rover/map/frame.h"

namespace rover {

// How well a keyframe's state was known when it was the newest one: from what came before it alone.
struct StateCovariance {
  InertialState mean;         // as it was estimated then
  Matrix15d given_map;        // its covariance, were the map around it exact
  Matrix15x3d response;       // how it errs with the map's tilt and scale (map_error.h), upright
  Eigen::Matrix3d map_error;  // the covariance of these
  Matrix7d drift;     // of its surroundings since the map began, as known today: see drift.h
  double anchor = 0;  // s since the map began: how old what it was tied to is, in the mean

  // Given position and yaw of the map around it alone.
  Matrix15d covariance() const { return given_map + response * map_error * response.transpose(); }
};

// A frame that the map keeps.
struct Keyframe {
  KeyframeId id;
  KeyframeId parent;  // in the spanning tree: most landmarks in common when it was made; invalid
                      // for the first keyframe of a map
  std::vector<KeyframeId> children;  // ascending
  KeyframeId previous, next;         // in time, of the same map; invalid at its ends
  Frame frame;

  // Inertial modes only.
  std::shared_ptr<const Preintegration> motion;        // since `previous`; null where unknown
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s, world; once the map is aligned
  ImuBias bias;
  double still_sigma = 0;  // m/s: the body stood still here, its velocity zero up to this; 0: it
                           // moved, or nobody knows
  std::shared_ptr<const StateCovariance> covariance;  // null: unknown

  const SE3& world_from_body() const { return frame.world_from_body; }
  InertialState state() const { return {frame.world_from_body, velocity, bias}; }
};

}  // namespace rover
