#pragma once

#include <vector>

#include <Eigen/Core>

namespace rover {

// A line through points, by arc length in m; a closed one comes back to its first point.
class Polyline {
 public:
  // At least two points that differ.
  Polyline(std::vector<Eigen::Vector3d> points, bool closed);

  double length() const { return starts_.back(); }
  bool closed() const { return closed_; }
  // Closed lines go round and round. Open ones go on straight beyond both ends.
  Eigen::Vector3d at(double distance) const;

 private:
  std::vector<Eigen::Vector3d> points_;
  std::vector<double> starts_;  // distance of each point
  bool closed_;
};

}  // namespace rover
