#pragma once

#include <functional>
#include <span>
#include <vector>

#include "rover/map/map.h"
#include "rover/optimization/map_adjustment.h"
#include "rover/optimization/pose_optimization.h"

namespace rover {

// A point that only the frame before knows (a stereo point that is no landmark), seen in a feature.
struct TemporaryPoint {
  Eigen::Vector3d point;  // m, world frame
  int feature = -1;
};

struct FramePose {
  PoseEstimate estimate;
  int landmarks = 0;  // inliers among the landmarks
  int temporary = 0;  // inliers among the temporary points
};

// Finds a frame's pose from what it sees.
using PoseSolver = std::function<PoseEstimate(const SE3& world_from_body,
                                              std::span<const PoseObservation> observations)>;

// Motion-only adjustment of a frame against the landmarks it is joined to (and temporary points),
// stereo partners included. Sets the frame's pose and parts it from landmarks that do not fit.
// An estimate that did not converge leaves the frame as it was.
FramePose solve_frame_pose(const Map& map, const PoseOptimizationOptions& options,
                           const WeightingOptions& weighting, Frame& frame,
                           const std::vector<TemporaryPoint>& temporary = {});

// The same with another solver.
FramePose solve_frame_pose_with(const PoseSolver& solve, const Map& map,
                                const WeightingOptions& weighting, Frame& frame,
                                const std::vector<TemporaryPoint>& temporary = {});

}  // namespace rover
