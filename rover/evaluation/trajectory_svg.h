#pragma once

#include <string>
#include <vector>

#include "rover/datasets/trajectory.h"

namespace rover {

// One line of the drawing, in the frame of the reference.
struct DrawnTrajectory {
  std::string name;
  Trajectory trajectory;
};

// A drawing (see svg.h) of the estimates over the reference: seen along the axis of least extent
// and from the side, both at one scale, with axes in metres and a legend. Lines break where poses
// are missing for more than a second. The reference may be empty.
std::string draw_trajectories(const DrawnTrajectory& reference,
                              const std::vector<DrawnTrajectory>& estimates);

// The first view only, 300 px wide, without axes and legend.
std::string draw_small(const DrawnTrajectory& reference,
                       const std::vector<DrawnTrajectory>& estimates);

}  // namespace rover
