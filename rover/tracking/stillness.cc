#include "rover/tracking/stillness.h"

#include <algorithm>

#include "rover/base/error.h"
#include "rover/base/quantile.h"

namespace rover {
namespace {

constexpr double kReferenceWidth = 640;

}  // namespace

void StillnessOptions::check() const {
  rest.check();
  require(min_duration > 0, "still.min_duration is {}; use a positive number of seconds",
          min_duration);
  require(max_pixel_motion > 0 && velocity_sigma > 0,
          "still.max_pixel_motion and velocity_sigma must be positive");
  require(min_landmarks > 0, "still.min_landmarks is {}; use 1 or more", min_landmarks);
}

StillnessDetector::StillnessDetector(const StillnessOptions& options, int image_width)
    : options_(options),
      max_pixel_motion_(options.max_pixel_motion * image_width / kReferenceWidth) {
  options_.check();
}

void StillnessDetector::see(const Frame& frame, std::span<const ImuSample> samples,
                            const ImuBias& bias) {
  View now = view_of(frame);
  if (!begin_ || !is_quiet(samples, bias, options_.rest) || !unmoved(now)) {
    begin_ = std::move(now);
    still_ = false;
    return;
  }
  const double elapsed = seconds_between(begin_->time, now.time);
  const double moved = (now.position - begin_->position).norm();
  still_ = elapsed >= options_.min_duration && moved < options_.velocity_sigma * elapsed;
}

void StillnessDetector::feel(std::span<const ImuSample> samples, const ImuBias& bias) {
  if (!is_quiet(samples, bias, options_.rest)) reset();
}

StillnessDetector::View StillnessDetector::view_of(const Frame& frame) {
  View view{frame.time, frame.world_from_body.translation, {}};
  for (const Observation& observation : frame.observations) {
    if (observation.landmark.valid()) {
      view.pixels.emplace_back(observation.landmark, observation.pixel);
    }
  }
  std::ranges::sort(view.pixels, {}, [](const auto& entry) { return entry.first; });
  return view;
}

bool StillnessDetector::unmoved(const View& now) const {
  std::vector<double> motions;
  auto then = begin_->pixels.begin();
  for (const auto& [landmark, pixel] : now.pixels) {
    while (then != begin_->pixels.end() && then->first < landmark) ++then;
    if (then == begin_->pixels.end()) break;
    if (then->first == landmark) motions.push_back((pixel - then->second).norm());
  }
  return static_cast<int>(motions.size()) >= options_.min_landmarks &&
         median(std::move(motions)) < max_pixel_motion_;
}

}  // namespace rover
