// The steps of the inertial mapper that calibrate camera and inertial sensor.

#include <algorithm>

#include "rover/mapping/inertial_mapper.h"
#include "rover/mapping/map_alignment.h"
#include "rover/mapping/recalibration.h"

namespace rover {
namespace {

constexpr double kWorthwhile = 1;  // chi-square

// What was given is believed until chance does not explain the difference; from then on the later
// estimate, of more data, is the better one.
bool is_worthwhile(const Map& map, const CalibrationResult& result) {
  return result.significant ||
         (result.accepted && map.calibration().changes > 0 && result.chi2_gain > kWorthwhile);
}

}  // namespace

// Clocks that are far apart would keep a map from being aligned at all.
void InertialMapper::shift_coarsely(SharedMap& shared, KeyframeId keyframe) const {
  const auto view = shared.view();
  const auto chain = linked_keyframes(*view, keyframe, options_.max_keyframes);
  const auto found = coarse_clock_offset(*view, chain);
  if (!found) return;
  shared.commit([&](Map& map) {
    recalibrate(map, {found->offset, map.rig().body_from_camera[0]});
    CalibrationStatus status = map.calibration();
    status.time_sigma = found->sigma;
    map.set_calibration(status);
  });
}

// Less and less often: later estimates change little.
bool InertialMapper::needs_calibration(const Map& map, Timestamp now) const {
  const CalibrationStatus& status = map.calibration();
  if (!options_.calibration.enabled() || status.settled) return false;
  if (status.estimated < map.inertial().begin)
    return seconds_between(map.inertial().begin, now) >= options_.first_calibration;
  const double wait = options_.calibration_interval * std::max(1, status.estimates);
  return seconds_between(status.estimated, now) >= wait;
}

InertialReport InertialMapper::calibrate(SharedMap& shared, KeyframeId keyframe) const {
  const auto view = shared.view();
  const auto chain = linked_keyframes(*view, keyframe, options_.max_calibrated);
  const auto problem = gather_calibration(*view, chain, weighting_, options_.adjustment);
  CalibrationResult result{.missing = "vision alone does not suffice"};
  if (problem) result = calibrate_camera_imu(*problem, options_.calibration);
  const Timestamp now = view->at(keyframe).frame.time;
  shared.commit(
      [&](Map& map) { map.set_calibration(status_after(map.calibration(), result, now)); });
  return is_worthwhile(*view, result) ? apply(shared, keyframe, result) : InertialReport{};
}

// A new calibration asks for gravity, scale and states anew, and like an initialisation it has to
// hold on a copy of the map first.
InertialReport InertialMapper::apply(SharedMap& shared, KeyframeId keyframe,
                                     const CalibrationResult& result) const {
  const auto view = shared.view();
  const auto chain = linked_keyframes(*view, keyframe, options_.max_keyframes);
  Map changed = *view;
  changed.freeze();
  recalibrate(changed, result.calibration);
  const Trial trial = try_alignment(changed, chain);
  if (!trial.missing.empty()) {
    shared.commit([&](Map& map) {
      CalibrationStatus status = map.calibration();
      status.missing = trial.missing;
      map.set_calibration(status);
    });
    return {};
  }
  InertialStatus status = view->inertial();
  status.refined = view->at(keyframe).frame.time;
  status.scale_sigma = trial.scale_sigma;
  shared.commit([&](Map& map) {
    recalibrate(map, result.calibration);
    align(map, chain, trial.alignment);
    commit_inertial_adjustment(map, trial.problem, trial.summary);
    map.set_inertial(status);
  });
  return {InertialEvent::kCalibrated, status.scale_sigma, ""};
}

}  // namespace rover
