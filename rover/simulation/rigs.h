#pragma once

#include <cstdint>
#include <string>

#include "rover/camera/camera.h"

namespace rover {

// The cameras to render for, in the body frame, which is the inertial sensor's: one of the built-in
// rigs, or those of EuRoC files.
//
// "euroc": 752x480, two pinhole cameras 11 cm apart; "tumvi": 512x512, two fisheye cameras 10 cm
// apart that see 195 degrees; "mono": one of 640x480; "paper": one of 1440x1080. Anything else is a
// path: a sensor.yaml or camchain.yaml, or a folder with cam0/sensor.yaml (and cam1/, mav0/).
//
// Throws InputError for what is neither, for calibration files that cannot be used, and for images
// whose width or height is odd, below 32 or above 8192 px.
Rig make_rig(const std::string& name_or_path);

// A camera that the given calibration describes with an error: focal lengths, principal point and
// the first two coefficients of distortion differ so that pixels are off by `error` px (root mean
// square over the image).
Camera disturbed_camera(const Camera& calibrated, double error, std::uint64_t seed);

}  // namespace rover
