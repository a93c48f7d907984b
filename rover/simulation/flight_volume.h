#pragma once

#include <vector>

#include <Eigen/Core>

namespace rover {

// Where in a scene a camera may fly without touching anything, and what it should look at.
struct FlightVolume {
  // The box that flights stay in (world, metres, z up).
  Eigen::Vector3d min = Eigen::Vector3d::Zero();
  Eigen::Vector3d max = Eigen::Vector3d::Zero();
  // Where the scene is long rather than wide (corridor, street): the line to fly along, and how far
  // from it one may stray; else empty.
  std::vector<Eigen::Vector3d> path;
  bool closed = false;  // the path ends where it begins
  double path_radius = 0;
};

}  // namespace rover
