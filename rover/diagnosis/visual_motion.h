#pragma once

#include <optional>
#include <span>

#include "rover/datasets/dataset.h"
#include "rover/slam/config.h"

namespace rover {

// From one stamp to another, both included.
struct TimeSpan {
  Timestamp begin = 0, end = 0;
};

// The `length` seconds (all, if there are less) in which the gyroscope turns most about at least
// two axes, with images throughout and inertial data around them. Nothing if images are nowhere
// close enough together. `images` and `imu` in order of time.
std::optional<TimeSpan> liveliest_span(std::span<const Timestamp> images,
                                       std::span<const ImuSample> imu, double length);

// world_from_camera0 in that span by visual SLAM, mono (scale unknown) or, where that places less
// than half of the frames and the dataset has two cameras, stereo. `input` is opened anew.
Trajectory visual_motion(DatasetOptions input, const TimeSpan& span, const Config& config);

}  // namespace rover
