#pragma once

#include "rover/geometry/random_geometry.h"
#include "rover/simulation/spline_motion.h"

namespace rover {

// Control points that walk at random: about 1 m/s and 1 rad/s where the interval is 0.1 s.
inline SplineMotion random_motion(double begin, double knot_interval, int control_points,
                                  std::uint64_t seed) {
  Random random(seed);
  std::vector<SE3> control = {random_pose(random)};
  while (static_cast<int>(control.size()) < control_points) {
    const SE3& last = control.back();
    const Eigen::Vector3d step = 0.06 * random_gaussian_vector(random);
    control.emplace_back(last.rotation * so3_exp(0.06 * random_gaussian_vector(random)),
                         last.translation + step);
  }
  return {begin, knot_interval, std::move(control)};
}

}  // namespace rover
