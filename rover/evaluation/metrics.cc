#include "rover/evaluation/metrics.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "rover/geometry/so3.h"

namespace rover {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kKittiStep = 100;  // metres
constexpr int kLengths = 8;

// The nearest of two equally near stamps is the earlier one.
const StampedPose& nearest(const Trajectory& trajectory, Timestamp time) {
  const auto after =
      std::lower_bound(trajectory.begin(), trajectory.end(), time,
                       [](const StampedPose& stamped, Timestamp t) { return stamped.time < t; });
  if (after == trajectory.begin()) return *after;
  const auto before = after - 1;
  if (after == trajectory.end()) return *before;
  return time - before->time <= after->time - time ? *before : *after;
}

// Angles below 1e-8 are lost in acos; the logarithm keeps them.
double angle_of(const SE3& motion) { return so3_log(motion.rotation).norm() * kDegrees; }

// The estimated motion from pair i to pair k, seen from the true one.
SE3 motion_error(const PosePair& from, const PosePair& to) {
  const SE3 truth = from.reference.inverse() * to.reference;
  return truth.inverse() * (from.estimate.inverse() * to.estimate);
}

// Distance along the reference path, per pair.
std::vector<double> distances_along(std::span<const PosePair> pairs) {
  std::vector<double> distances;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    distances.push_back(
        i == 0 ? 0
               : distances.back() +
                     (pairs[i].reference.translation - pairs[i - 1].reference.translation).norm());
  }
  return distances;
}

void add_stretches(std::span<const PosePair> pairs, const std::vector<double>& distances,
                   double length, std::size_t step, DistanceErrors& sums) {
  for (std::size_t i = 0; i < pairs.size(); i += step) {
    const auto end = std::lower_bound(distances.begin(), distances.end(), distances[i] + length);
    if (end == distances.end()) return;
    const SE3 error =
        motion_error(pairs[i], pairs[static_cast<std::size_t>(end - distances.begin())]);
    sums.translation += 100 * error.translation.norm() / length;
    sums.rotation += angle_of(error) / length;
    ++sums.count;
  }
}

}  // namespace

ErrorStatistics statistics_of(std::vector<double> errors) {
  ErrorStatistics result;
  result.count = errors.size();
  if (errors.empty()) return result;
  std::sort(errors.begin(), errors.end());
  const double n = static_cast<double>(errors.size());
  result.min = errors.front();
  result.max = errors.back();
  result.median = 0.5 * (errors[(errors.size() - 1) / 2] + errors[errors.size() / 2]);
  result.mean = std::accumulate(errors.begin(), errors.end(), 0.0) / n;
  double squares = 0, deviations = 0;
  for (double error : errors) {
    squares += error * error;
    deviations += (error - result.mean) * (error - result.mean);
  }
  result.rmse = std::sqrt(squares / n);
  result.std = std::sqrt(deviations / n);
  return result;
}

std::vector<PosePair> associate(const Trajectory& estimate, const Trajectory& reference,
                                double max_difference) {
  std::vector<PosePair> pairs;
  if (estimate.empty() || reference.empty()) return pairs;
  const bool estimate_is_shorter = estimate.size() <= reference.size();
  const Trajectory& shorter = estimate_is_shorter ? estimate : reference;
  const Trajectory& longer = estimate_is_shorter ? reference : estimate;
  for (const StampedPose& stamped : shorter) {
    const StampedPose& partner = nearest(longer, stamped.time);
    if (std::abs(seconds_between(stamped.time, partner.time)) > max_difference) continue;
    const StampedPose& own = estimate_is_shorter ? stamped : partner;
    const StampedPose& truth = estimate_is_shorter ? partner : stamped;
    pairs.push_back({own.time, own.pose, truth.pose});
  }
  return pairs;
}

std::optional<Sim3> align(std::span<const PosePair> pairs, AlignmentKind kind) {
  std::vector<Eigen::Vector3d> from, to;
  for (const PosePair& pair : pairs) {
    from.push_back(pair.estimate.translation);
    to.push_back(pair.reference.translation);
  }
  const auto alignment = align_points(from, to, kind);
  if (!alignment) return std::nullopt;
  return alignment->to_from_from;
}

std::vector<PosePair> move_estimates(const Sim3& reference_from_estimate,
                                     std::span<const PosePair> pairs) {
  std::vector<PosePair> moved(pairs.begin(), pairs.end());
  for (PosePair& pair : moved) pair.estimate = move_pose(reference_from_estimate, pair.estimate);
  return moved;
}

Trajectory move_world(const Sim3& new_world_from_world, const Trajectory& trajectory) {
  Trajectory moved = trajectory;
  for (StampedPose& stamped : moved) stamped.pose = move_pose(new_world_from_world, stamped.pose);
  return moved;
}

std::vector<double> position_errors(std::span<const PosePair> aligned) {
  std::vector<double> errors;
  for (const PosePair& pair : aligned) {
    errors.push_back((pair.estimate.translation - pair.reference.translation).norm());
  }
  return errors;
}

RelativeErrors frame_to_frame_errors(std::span<const PosePair> aligned) {
  RelativeErrors errors;
  for (std::size_t i = 1; i < aligned.size(); ++i) {
    const SE3 error = motion_error(aligned[i - 1], aligned[i]);
    errors.translation.push_back(error.translation.norm());
    errors.rotation.push_back(angle_of(error));
  }
  return errors;
}

DistanceErrors distance_errors(std::span<const PosePair> aligned) {
  DistanceErrors result;
  const std::vector<double> distances = distances_along(aligned);
  const double whole = distances.empty() ? 0 : distances.back();
  if (!(whole > 0)) return result;
  const bool long_path = whole > kKittiStep;
  const double unit = long_path ? kKittiStep : whole / 10;
  for (int k = 1; k <= kLengths && k * unit < whole; ++k) {
    result.lengths.push_back(k * unit);
    add_stretches(aligned, distances, k * unit, long_path ? 10 : 1, result);
  }
  if (result.count == 0) return result;
  result.translation /= static_cast<double>(result.count);
  result.rotation /= static_cast<double>(result.count);
  return result;
}

double path_length(std::span<const PosePair> pairs) {
  const std::vector<double> distances = distances_along(pairs);
  return distances.empty() ? 0 : distances.back();
}

double longest_gap(const Trajectory& trajectory, Timestamp begin, Timestamp end) {
  Timestamp last = begin, longest = 0;
  for (const StampedPose& stamped : trajectory) {
    if (stamped.time < begin || stamped.time > end) continue;
    longest = std::max(longest, stamped.time - last);
    last = stamped.time;
  }
  return seconds_between(0, std::max(longest, end - last));
}

}  // namespace rover
