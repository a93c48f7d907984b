#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "rover/imu/rest.h"
#include "rover/map/frame.h"

namespace rover {

struct StillnessOptions {
  double min_duration = 1;      // s that all of the following hold
  double max_pixel_motion = 1;  // px at 640 wide: median motion of landmarks in the image meanwhile
  int min_landmarks = 15;       // that both images see
  double velocity_sigma = 0.01;  // m/s: standing still is known to this, and nothing that was
                                 // faster meanwhile is called still
  RestOptions rest;              // of the inertial data

  void check() const;
};

// Recognises that the body stands still: inertial data as at rest, and an image that does not move.
// Each alone errs: inertial data cannot tell rest from steady flight, and images of far things move
// little. Hovering in the air vibrates and is not called still.
class StillnessDetector {
 public:
  // image_width: px, of camera 0.
  StillnessDetector(const StillnessOptions& options, int image_width);

  // A frame whose pose was found, with the inertial data since the one before.
  void see(const Frame& frame, std::span<const ImuSample> samples, const ImuBias& bias);
  // A frame without vision: stillness lasts while the inertial data stay quiet.
  void feel(std::span<const ImuSample> samples, const ImuBias& bias);
  void reset() { begin_.reset(), still_ = false; }

  bool still() const { return still_; }
  // Since when; for a body that stands still.
  Timestamp since() const { return begin_->time; }
  // Whether that holds after these samples too.
  bool still_after(std::span<const ImuSample> samples, const ImuBias& bias) const {
    return still_ && is_quiet(samples, bias, options_.rest);
  }

 private:
  struct View {
    Timestamp time = 0;
    Eigen::Vector3d position;
    std::vector<std::pair<LandmarkId, Eigen::Vector2f>> pixels;  // ascending
  };
  static View view_of(const Frame& frame);
  bool unmoved(const View& now) const;

  StillnessOptions options_;
  double max_pixel_motion_;
  std::optional<View> begin_;  // the view that has not moved since
  bool still_ = false;
};

}  // namespace rover
