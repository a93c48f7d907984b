#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "rover/datasets/trajectory.h"
#include "rover/geometry/alignment.h"

namespace rover {

// Distribution of errors. std is that of the whole population, as usual for trajectories.
struct ErrorStatistics {
  std::size_t count = 0;
  double rmse = 0, mean = 0, median = 0, max = 0, min = 0, std = 0;
};
ErrorStatistics statistics_of(std::vector<double> errors);  // all zero for no errors

// Poses of one instant: of an estimate and of the reference, with the estimate's time.
struct PosePair {
  Timestamp time = 0;
  SE3 estimate;
  SE3 reference;
};

// Each pose of the shorter trajectory with the nearest in time of the longer one, at most
// `max_difference` seconds apart.
std::vector<PosePair> associate(const Trajectory& estimate, const Trajectory& reference,
                                double max_difference);

// The transform reference_from_estimate that lays the estimated positions over the reference's.
// Nothing where they do not determine it: too few, or all on one line or in one place.
std::optional<Sim3> align(std::span<const PosePair> pairs, AlignmentKind kind);
// The pairs with their estimates moved by it.
std::vector<PosePair> move_estimates(const Sim3& reference_from_estimate,
                                     std::span<const PosePair> pairs);

Trajectory move_world(const Sim3& new_world_from_world, const Trajectory& trajectory);

// Absolute trajectory error: distances between the positions of aligned pairs, in metres.
std::vector<double> position_errors(std::span<const PosePair> aligned);

// Relative pose error: of the motion from each pair to the next.
struct RelativeErrors {
  std::vector<double> translation;  // metres
  std::vector<double> rotation;     // degrees
};
RelativeErrors frame_to_frame_errors(std::span<const PosePair> aligned);

// Errors of the motion over stretches of the reference path, per metre of it (Geiger et al.,
// "Are we ready for autonomous driving? The KITTI vision benchmark suite", 2012).
struct DistanceErrors {
  std::vector<double> lengths;  // metres, of the stretches
  std::size_t count = 0;        // stretches; with none the errors are 0
  double translation = 0;       // mean, percent
  double rotation = 0;          // mean, degrees per metre
};
// Lengths of 100 m, 200 m ... 800 m begun at every tenth pair, where the path is longer than 100 m;
// else a tenth, two tenths ... eight tenths of the path, begun at every pair.
DistanceErrors distance_errors(std::span<const PosePair> aligned);

// Length of the path through the reference positions, in metres.
double path_length(std::span<const PosePair> pairs);

// The longest time without a pose, in seconds, from `begin` to `end`, which count as poses.
double longest_gap(const Trajectory& trajectory, Timestamp begin, Timestamp end);

}  // namespace rover
