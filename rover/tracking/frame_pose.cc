#include "rover/tracking/frame_pose.h"

namespace rover {
namespace {

// The observations of a frame as the solver wants them, with the feature each came from.
struct Gathered {
  std::vector<PoseObservation> observations;
  std::vector<int> features;
  std::vector<char> is_landmark;

  void add(const Frame& frame, int feature, const Eigen::Vector3d& point, bool landmark,
           const WeightingOptions& weighting) {
    const auto [place, disparity] = measurements_of(frame, feature, weighting);
    append(point, place, feature, landmark);
    if (disparity) append(point, *disparity, feature, landmark);
  }
  void append(const Eigen::Vector3d& point, const Measurement& seen, int feature, bool landmark) {
    observations.push_back({point, seen.pixel, seen.camera, seen.sigma});
    features.push_back(feature);
    is_landmark.push_back(landmark);
  }
};

}  // namespace

FramePose solve_frame_pose(const Map& map, const PoseOptimizationOptions& options,
                           const WeightingOptions& weighting, Frame& frame,
                           const std::vector<TemporaryPoint>& temporary) {
  const auto solve = [&](const SE3& initial, std::span<const PoseObservation> observations) {
    return optimize_pose(map.rig(), initial, observations, options);
  };
  return solve_frame_pose_with(solve, map, weighting, frame, temporary);
}

FramePose solve_frame_pose_with(const PoseSolver& solve, const Map& map,
                                const WeightingOptions& weighting, Frame& frame,
                                const std::vector<TemporaryPoint>& temporary) {
  Gathered gathered;
  for (int i = 0; i < frame.size(); ++i) {
    if (!frame[i].landmark.valid()) continue;
    if (const Landmark* landmark = map.find(frame[i].landmark)) {
      gathered.add(frame, i, landmark->position, true, weighting);
    } else {
      frame.unjoin(i);
    }
  }
  for (const auto& [point, feature] : temporary) {
    gathered.add(frame, feature, point, false, weighting);
  }
  FramePose result;
  result.estimate = solve(frame.world_from_body, gathered.observations);
  if (!result.estimate.converged) return result;
  frame.world_from_body = result.estimate.world_from_body;
  for (std::size_t i = 0; i < gathered.features.size(); ++i) {
    if (gathered.observations[i].camera != 0) continue;
    const bool inlier = result.estimate.inliers[i];
    if (gathered.is_landmark[i] && !inlier) frame.unjoin(gathered.features[i]);
    (gathered.is_landmark[i] ? result.landmarks : result.temporary) += inlier;
  }
  return result;
}

}  // namespace rover
