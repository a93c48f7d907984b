#pragma once

#include <vector>

#include "rover/simulation/motion.h"
#include "rover/simulation/spline_basis.h"

namespace rover {

// A motion through uniform B-splines of order 6: the position's of its control points, the
// orientation's cumulative on SO(3) with exact derivatives by the recursion of Sommer, Usenko,
// Schubert, Demmel, Cremers, "Efficient derivative computation for cumulative B-splines on Lie
// groups" (2020). Acceleration is twice continuously differentiable, angular acceleration likewise.
//
// The curve runs near its control points rather than through them, and inside the convex hull of
// any six neighbours. Control point i sits at begin + (i - 2) * knot_interval.
class SplineMotion final : public Motion {
 public:
  // Throws InputError unless there are six control points or more and the interval (s) is positive.
  // Neighbouring orientations should lie well below 180 degrees apart.
  SplineMotion(double begin, double knot_interval, std::vector<SE3> control);

  double begin() const override { return begin_; }
  double end() const override;
  MotionState at(double seconds) const override;
  // world_from_body alone, in half the time.
  SE3 pose_at(double seconds) const;

  double knot_interval() const { return knot_interval_; }
  const std::vector<SE3>& control() const { return control_; }  // world_from_body

  // Which six control points, `first` and its followers, shape the motion at a time, and where in
  // the knot interval that is. Times outside begin() .. end() are moved to the nearer end.
  struct Place {
    int first = 0;
    double u = 0;  // in [0, 1]
  };
  Place place_of(double seconds) const;
  // log(control[i - 1]^-1 control[i]) of the orientations, in rad; i >= 1.
  const Eigen::Vector3d& rotation_increment(int i) const { return increments_[i - 1]; }

 private:
  double begin_, knot_interval_;
  std::vector<SE3> control_;
  std::vector<Eigen::Vector3d> increments_;
};

}  // namespace rover
