#pragma once

#include "rover/camera/camera.h"
#include "rover/diagnosis/finding.h"

namespace rover {

// Looks over what a calibration says by itself: focal lengths, field of view, principal point,
// where the distortion model has an inverse, the baseline of a stereo pair, the place of camera 0
// on the inertial sensor (`inertial`). That transforms are rigid and images have the calibrated
// size was seen to by the reader.
void check_calibration(const Rig& rig, bool inertial, Findings& findings);

}  // namespace rover
