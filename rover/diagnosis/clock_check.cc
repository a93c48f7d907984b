#include "rover/diagnosis/clock_check.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "rover/base/quantile.h"

namespace rover {
namespace {

constexpr double kSparse = 0.25;  // s: frames farther apart cannot be tracked

struct Steps {
  std::vector<double> all;  // s
  double usual = 0;
  int gaps = 0;  // steps of more than one and a half usual ones
  double longest = 0;
};

Steps steps_of(const std::vector<Timestamp>& times) {
  Steps steps;
  for (std::size_t i = 1; i < times.size(); ++i)
    steps.all.push_back(seconds_between(times[i - 1], times[i]));
  steps.usual = median(steps.all);
  for (const double step : steps.all) {
    if (step > 1.5 * steps.usual) ++steps.gaps;
    steps.longest = std::max(steps.longest, step);
  }
  return steps;
}

void check_image_rate(const DatasetSurvey& survey, const Steps& steps, Topic& topic) {
  topic.add(
      judge_above(steps.usual, 0.12, kSparse), "image_rate",
      fmt::format("{} frames over {:.1f} s, {:.1f} per second", survey.times.size(),
                  seconds_between(survey.times.front(), survey.times.back()), 1 / steps.usual),
      "tracking wants 10 frames per second or more unless the motion is slow", 1 / steps.usual);
}

void check_image_steps(const Steps& steps, Topic& topic) {
  if (steps.usual > kSparse) return;  // no regular recording: the rate has told it
  std::vector<double> jitter;
  for (const double step : steps.all)
    if (step <= 1.5 * steps.usual) jitter.push_back(std::abs(step - steps.usual));
  const double wide = quantile(jitter, 0.95);
  topic.add(
      judge_above(wide / steps.usual, 0.25, 0.45), "image_jitter",
      fmt::format("95% of the image stamps are within {:.2f} ms of the usual step", 1e3 * wide),
      "stamps should be the camera's mid-exposure, not when the driver saw the image", wide);
  if (steps.gaps == 0) return;
  const double share = steps.gaps / static_cast<double>(steps.all.size());
  const bool bad = steps.longest > std::max(0.5, 3 * steps.usual) || share > 0.1;
  topic.add(bad ? Severity::kWarning : Severity::kNote, "image_gaps",
            fmt::format("{} gaps between images ({:.1f}% of the steps), the longest of {:.3f} s",
                        steps.gaps, 100 * share, steps.longest),
            "frames were dropped: look at the recorder's disk and buffers", steps.longest);
}

void check_missing(const DatasetSurvey& survey, Topic& topic) {
  if (!survey.image_problems.empty())
    topic.add(Severity::kWarning, "unreadable_images",
              fmt::format("{} images cannot be used, the first: {}", survey.image_problems.size(),
                          survey.image_problems.front()),
              "these frames are skipped; copy the files again",
              static_cast<double>(survey.image_problems.size()));
  if (!survey.stereo() || survey.missing[1] == 0) return;
  const double share = survey.missing[1] / static_cast<double>(survey.times.size());
  topic.add(judge_above(share, 0, 0.02), "missing_partners",
            fmt::format("{} of {} frames have no image of camera 1", survey.missing[1],
                        survey.times.size()),
            "they are used as mono; are both cameras triggered together and stamped alike?", share);
}

void check_coverage(const DatasetSurvey& survey, Topic& topic) {
  if (survey.imu.empty()) return;
  constexpr Timestamp kReach = 20'000'000;  // ns, as ImuBuffer::covers
  const Timestamp begin = survey.imu.front().time - kReach, end = survey.imu.back().time + kReach;
  const auto outside = std::count_if(survey.times.begin(), survey.times.end(),
                                     [&](Timestamp t) { return t < begin || t > end; });
  const double share = static_cast<double>(outside) / static_cast<double>(survey.times.size());
  topic.add(judge_above(share, 0, 0.02), "imu_coverage",
            outside == 0 ? std::string("inertial data reach over all images")
                         : fmt::format("{} of {} images lie outside of the inertial data", outside,
                                       survey.times.size()),
            "these frames can only be tracked by vision: are both of one clock?", share);
}

void check_notes(const DatasetSurvey& survey, Topic& topic) {
  for (const std::string& note : survey.notes)
    topic.add(Severity::kWarning, "reader", note, "the rest is used; mend the file");
}

void check_ground_truth(const DatasetSurvey& survey, Findings& findings) {
  Topic topic("ground truth", findings);
  if (survey.ground_truth.size() < 2) {
    topic.ok("ground_truth", "there is none");
    return;
  }
  std::vector<Timestamp> times;
  for (const StampedPose& pose : survey.ground_truth) times.push_back(pose.time);
  const Steps steps = steps_of(times);
  const auto covered = std::count_if(survey.times.begin(), survey.times.end(), [&](Timestamp t) {
    return t >= times.front() && t <= times.back();
  });
  const double share = static_cast<double>(covered) / static_cast<double>(survey.times.size());
  topic.add(share > 0.5 ? Severity::kOk : Severity::kNote, "ground_truth",
            fmt::format("{} poses, {:.1f} per second, over {:.1f}% of the frames; longest gap "
                        "{:.2f} s",
                        times.size(), 1 / steps.usual, 100 * share, steps.longest),
            "figures against it will be those of a part of the sequence", share);
}

}  // namespace

void check_clocks(const DatasetSurvey& survey, Findings& findings) {
  Topic topic("clocks", findings);
  check_notes(survey, topic);
  if (survey.times.size() > 2) {
    const Steps steps = steps_of(survey.times);
    check_image_rate(survey, steps, topic);
    check_image_steps(steps, topic);
  } else {
    topic.add(Severity::kWarning, "image_rate",
              fmt::format("there are {} frames: too few for a run", survey.times.size()),
              "record for longer");
  }
  check_missing(survey, topic);
  check_coverage(survey, topic);
  check_ground_truth(survey, findings);
}

}  // namespace rover
