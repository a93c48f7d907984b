#include "rover/mapping/recalibration.h"

#include <algorithm>
#include <cmath>

#include "rover/imu/clock_shift.h"
#include "rover/optimization/camera_imu_alignment.h"
#include "rover/optimization/pose_information.h"

namespace rover {
namespace {

// Information in the tangents of the cameras instead of those of the bodies.
Eigen::MatrixXd by_cameras(const Eigen::MatrixXd& by_bodies, const SE3& body_from_camera) {
  const Matrix6d jacobian = body_by_camera(body_from_camera);
  Eigen::MatrixXd result(by_bodies.rows(), by_bodies.cols());
  for (Eigen::Index i = 0; i < by_bodies.rows(); i += 6) {
    for (Eigen::Index j = 0; j < by_bodies.cols(); j += 6)
      result.block<6, 6>(i, j) = jacobian.transpose() * by_bodies.block<6, 6>(i, j) * jacobian;
  }
  return result;
}

std::vector<Preintegration> motions_of(const Map& map, const std::vector<KeyframeId>& chain) {
  std::vector<Preintegration> motions;
  for (std::size_t i = 1; i < chain.size(); ++i) motions.push_back(*map.at(chain[i]).motion);
  return motions;
}

// What is known where the map's stamps were moved already.
CameraImuCalibration given(const Map& map) {
  const CalibrationStatus& status = map.calibration();
  return {-seconds_between(0, status.time_offset),
          status.given.value_or(map.rig().body_from_camera[0])};
}

// All keyframes in time, cut where no inertial data link them.
std::vector<std::vector<KeyframeId>> chains_of(const Map& map) {
  std::vector<std::vector<KeyframeId>> chains;
  bool linked = false;
  for (KeyframeId id = map.newest_keyframe(); id.valid(); id = map.at(id).previous) {
    if (!linked) chains.emplace_back();
    chains.back().push_back(id);
    linked = map.at(id).motion != nullptr;
  }
  for (auto& chain : chains) std::ranges::reverse(chain);
  return chains;
}

void shift_motions(Map& map, Timestamp shift) {
  const std::vector<ImuSample> after = map.readings_after();
  for (const auto& chain : chains_of(map)) {
    const bool is_newest = chain.back() == map.newest_keyframe();
    const auto shifted = with_shifted_clock(motions_of(map, chain),
                                            is_newest ? after : std::vector<ImuSample>{}, shift);
    for (std::size_t i = 0; i < shifted.size(); ++i)
      map.set_motion(chain[i + 1], std::make_shared<const Preintegration>(shifted[i]));
  }
  std::vector<ImuSample> moved = after;
  for (ImuSample& sample : moved) sample.time -= shift;
  map.set_readings_after(std::move(moved));
}

}  // namespace

std::optional<CalibrationProblem> gather_calibration(const Map& map,
                                                     const std::vector<KeyframeId>& chain,
                                                     const WeightingOptions& weighting,
                                                     const BundleOptions& adjustment) {
  MapProblem visual = gather_problem(map, chain, 0, weighting);
  const BundleSummary summary = adjust(visual, adjustment);
  if (!summary.usable || visual.keyframes != chain) return std::nullopt;
  const SE3& body_from_camera = map.rig().body_from_camera[0];
  CalibrationProblem problem;
  problem.information =
      by_cameras(pose_information(visual.bundle, summary.inliers, adjustment), body_from_camera);
  if (problem.information.rows() == 0) return std::nullopt;
  for (std::size_t i = 0; i < chain.size(); ++i) {
    problem.world_from_camera.push_back(visual.bundle.world_from_body[i] * body_from_camera);
    problem.velocity.push_back(map.at(chain[i]).velocity);
  }
  problem.motions = motions_of(map, chain);
  problem.after = map.readings_after();
  problem.bias = map.at(chain.back()).bias;
  problem.now = {0, body_from_camera};
  problem.given = given(map);
  return problem;
}

std::optional<ClockOffset> coarse_clock_offset(const Map& map,
                                               const std::vector<KeyframeId>& chain) {
  constexpr double kCertain = 0.003;  // s
  std::vector<StampedRotation> rotations;
  for (const KeyframeId id : chain) {
    const Keyframe& keyframe = map.at(id);
    rotations.push_back({keyframe.frame.time, keyframe.world_from_body().rotation *
                                                  map.rig().body_from_camera[0].rotation});
  }
  const ImuBuffer samples = joined_samples(motions_of(map, chain), map.readings_after(), 0);
  const auto found = align_camera_to_imu(rotations, samples, {});
  if (!found || found->time_sigma > kCertain) return std::nullopt;
  if (std::abs(found->time_offset) < std::max(kCertain, 3 * found->time_sigma)) return std::nullopt;
  return ClockOffset{found->time_offset, found->time_sigma};
}

void recalibrate(Map& map, const CameraImuCalibration& calibration) {
  const Timestamp shift = from_seconds(calibration.time_offset);
  if (shift != 0) shift_motions(map, shift);
  map.move_rig(calibration.body_from_camera);
  CalibrationStatus status = map.calibration();
  status.time_offset += shift;
  status.changes += 1;
  map.set_calibration(status);
}

CalibrationStatus status_after(CalibrationStatus status, const CalibrationResult& result,
                               Timestamp now) {
  constexpr double kCertainTime = 0.0003, kCertainRotation = 0.001;  // s, rad
  status.estimated = now;
  status.missing = result.missing;
  if (!result.accepted) return status;
  status.estimates += 1;
  status.time_sigma = result.time_sigma;
  status.rotation_sigma = result.rotation_sigma;
  status.translation_sigma = result.translation_sigma;
  status.settled = !result.significant && result.time_sigma < kCertainTime &&
                   result.rotation_sigma.maxCoeff() < kCertainRotation;
  return status;
}

}  // namespace rover
