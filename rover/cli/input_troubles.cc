#include "rover/cli/input_troubles.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "rover/base/quantile.h"

namespace rover {
namespace {

using Json = nlohmann::ordered_json;

std::vector<double> steps_of(const std::vector<Timestamp>& times) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) {
    steps.push_back(seconds_between(times[i - 1], times[i]));
  }
  return steps;
}

double length_of(const VisionGap& gap) { return seconds_between(gap.begin, gap.end); }
double drift_of(const VisionGap& gap) { return gap.reckoned_from_seen.translation.norm(); }
double turn_of(const VisionGap& gap) {
  return so3_log(gap.reckoned_from_seen.rotation).norm() * 180 / std::numbers::pi;
}

}  // namespace

void InputTroubles::offer(const SensorFrame& frame) {
  images_.push_back(frame.time);
  for (const ImuSample& sample : frame.imu) samples_.push_back(sample.time);
}

std::string InputTroubles::hear(const TrackingResult& result) {
  repeated_ += result.repeated;
  left_out_ += result.left_out;
  if (!result.gap) return "";
  vision_gaps_.push_back(*result.gap);
  return fmt::format(
      "vision lost at {} s for {:.2f} s; inertial data carried on; drift over the gap {:.3f} m, "
      "{:.2f} deg",
      format_seconds(result.gap->begin), length_of(*result.gap), drift_of(*result.gap),
      turn_of(*result.gap));
}

// The usual step is short of the median where many are missing.
int InputTroubles::missing_images() const {
  constexpr double kUsual = 0.25, kTolerated = 1.5;
  const auto steps = steps_of(images_);
  const double usual = quantile(steps, kUsual);
  int missing = 0;
  for (const double step : steps) {
    if (step > kTolerated * usual) missing += static_cast<int>(std::lround(step / usual)) - 1;
  }
  return missing;
}

std::vector<ImuGap> InputTroubles::imu_gaps() const {
  const auto steps = steps_of(samples_);
  const double limit = std::max(min_imu_gap_, 3 * median(steps));
  std::vector<ImuGap> gaps;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i] > limit) gaps.push_back({samples_[i], steps[i]});
  }
  return gaps;
}

double InputTroubles::silent_end() const {
  constexpr double kTolerated = 0.1;  // s
  if (samples_.empty() || images_.empty()) return 0;
  const double silent = seconds_between(samples_.back(), images_.back());
  return silent > kTolerated ? silent : 0;
}

std::vector<std::string> InputTroubles::lines() const {
  std::vector<std::string> lines;
  const auto say = [&](std::string line) { lines.push_back(std::move(line)); };
  if (const int missing = missing_images(); missing > 0) {
    say(fmt::format("{} images are missing between those that came", missing));
  }
  if (repeated_ > 0) {
    say(fmt::format("{} images repeated the one before: inertial data alone were used for them",
                    repeated_));
  }
  if (left_out_ > 0) say(fmt::format("{} images were left out: late or repeated", left_out_));
  if (refused_samples_ > 0) {
    say(fmt::format("{} inertial samples were left out: not numbers, or not in order",
                    refused_samples_));
  }
  if (const auto gaps = imu_gaps(); !gaps.empty()) {
    const auto longest = std::ranges::max_element(gaps, {}, &ImuGap::length);
    say(
        fmt::format("{} gap(s) in the inertial data, the longest of {:.3f} s at {} s: vision alone "
                    "tells the motion there",
                    gaps.size(), longest->length, format_seconds(longest->begin)));
  }
  if (silent_end() > 0) {
    say(
        fmt::format("inertial data ended at {} s, {:.2f} s before the images: the rest was done by "
                    "vision alone",
                    format_seconds(samples_.back()), silent_end()));
  }
  return lines;
}

Json InputTroubles::describe() const {
  Json json;
  json["missing_images"] = missing_images();
  json["repeated_images"] = repeated_;
  json["left_out_images"] = left_out_;
  json["left_out_samples"] = refused_samples_;
  json["imu_gaps"] = Json::array();
  for (const ImuGap& gap : imu_gaps()) {
    json["imu_gaps"].push_back({{"begin", format_seconds(gap.begin)}, {"length", gap.length}});
  }
  json["imu_silent_at_end"] = silent_end();
  json["vision_gaps"] = Json::array();
  for (const VisionGap& gap : vision_gaps_) {
    json["vision_gaps"].push_back({{"begin", format_seconds(gap.begin)},
                                   {"length", length_of(gap)},
                                   {"frames", gap.frames},
                                   {"drift_m", drift_of(gap)},
                                   {"drift_deg", turn_of(gap)}});
  }
  return json;
}

}  // namespace rover
