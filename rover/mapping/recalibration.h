#pragma once

#include <optional>
#include <vector>

#include "rover/map/map.h"
#include "rover/optimization/camera_imu_calibration.h"
#include "rover/optimization/map_adjustment.h"

namespace rover {

// Keyframes that inertial data link without a break (in order of time, ids ascending) as a problem
// of calibration: their poses as vision alone finds them, adjusted anew, since those of the map
// lean towards the calibration in force. Nothing where vision alone does not suffice.
std::optional<CalibrationProblem> gather_calibration(const Map& map,
                                                     const std::vector<KeyframeId>& chain,
                                                     const WeightingOptions& weighting,
                                                     const BundleOptions& adjustment);

struct ClockOffset {
  double offset = 0;  // s by which the inertial sensor's stamps are too late
  double sigma = 0;   // s
};

// How far the clocks are apart by turns alone, for a map that is not aligned. Nothing where that
// does not show, or is little.
std::optional<ClockOffset> coarse_clock_offset(const Map& map,
                                               const std::vector<KeyframeId>& chain);

// Puts a calibration in force: the offset is on top of what the map's motions have been cut for.
// Motions are cut anew, the rig moves (see Map::move_rig).
void recalibrate(Map& map, const CameraImuCalibration& calibration);

// A calibration status after an estimate at `now`.
CalibrationStatus status_after(CalibrationStatus status, const CalibrationResult& result,
                               Timestamp now);

}  // namespace rover
