#include "rover/simulation/motion_fit.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "rover/base/error.h"
#include "rover/simulation/motion_fit_problem.h"

namespace rover {
namespace {

constexpr double kShortest = 2;       // s
constexpr double kSlow = 5;           // Hz
constexpr double kStretch = 5;        // s
constexpr double kKnotsPerGap = 0.6;  // without inertial data: knot intervals in the longest gap

// --- the part of the ground truth to fit --------------------------------------------------------

double duration_of(const Trajectory& trajectory) {
  return trajectory.empty() ? 0 : seconds_between(trajectory.front().time, trajectory.back().time);
}

// Poses within the times; both may reach beyond the trajectory.
Trajectory within(const Trajectory& trajectory, Timestamp begin, Timestamp end) {
  Trajectory part;
  std::copy_if(trajectory.begin(), trajectory.end(), std::back_inserter(part),
               [&](const StampedPose& pose) { return begin <= pose.time && pose.time <= end; });
  return part;
}

Trajectory chosen_part(const Trajectory& trajectory, const MotionFitOptions& options) {
  require(!trajectory.empty(), "flight: the ground truth is empty");
  const Timestamp begin = trajectory.front().time + from_seconds(options.start);
  const Timestamp end =
      options.duration > 0 ? begin + from_seconds(options.duration) : trajectory.back().time;
  return within(trajectory, begin, end);
}

Trajectory part_with_imu(const Trajectory& trajectory, const std::vector<ImuSample>& imu) {
  if (imu.empty()) return trajectory;
  Trajectory part = within(trajectory, imu.front().time, imu.back().time);
  require(!part.empty(),
          "flight: inertial data and ground truth do not overlap in time; are both of one flight "
          "and one clock?");
  return part;
}

std::vector<Trajectory> split_at_gaps(const Trajectory& trajectory, double max_gap) {
  std::vector<Trajectory> parts;
  for (const StampedPose& pose : trajectory) {
    if (parts.empty() || seconds_between(parts.back().back().time, pose.time) > max_gap) {
      parts.emplace_back();
    }
    parts.back().push_back(pose);
  }
  return parts;
}

Trajectory part_without_gaps(const Trajectory& trajectory, const MotionFitOptions& options) {
  const auto parts = split_at_gaps(trajectory, options.max_gap);
  if (parts.empty()) return {};
  require(parts.size() == 1 || options.cut,
          "flight: the ground truth has {} gaps of more than {} s, the first {:.2f} s after its "
          "first pose; choose a stretch without, or have it cut",
          parts.size() - 1, options.max_gap, duration_of(parts.front()));
  return *std::max_element(parts.begin(), parts.end(), [](const auto& a, const auto& b) {
    return duration_of(a) < duration_of(b);
  });
}

Trajectory select(const Trajectory& ground_truth, const std::vector<ImuSample>& imu,
                  const MotionFitOptions& options) {
  Trajectory part =
      part_without_gaps(part_with_imu(chosen_part(ground_truth, options), imu), options);
  require(duration_of(part) >= kShortest,
          "flight: {:.2f} s of ground truth are too short; it takes {} s or more",
          duration_of(part), kShortest);
  return part;
}

// --- the problem --------------------------------------------------------------------------------

// Without inertial data nothing but poses says how the body moved between them.
double knot_interval(const Trajectory& part, bool inertial, const MotionFitOptions& options) {
  if (inertial) return options.knot_interval;
  double longest = 0;
  for (std::size_t i = 1; i < part.size(); ++i) {
    longest = std::max(longest, seconds_between(part[i - 1].time, part[i].time));
  }
  const double mean = duration_of(part) / static_cast<double>(part.size() - 1);
  return std::max({options.knot_interval, 1.5 * mean, kKnotsPerGap * longest});
}

MotionFitProblem make_problem(const Trajectory& part, const std::vector<ImuSample>& imu,
                              const MotionFitOptions& options) {
  const Timestamp origin = part.front().time;
  const double duration = duration_of(part);
  std::vector<MotionFitProblem::Pose> poses;
  for (const StampedPose& pose : part) {
    poses.push_back({seconds_between(origin, pose.time), pose.pose});
  }
  std::vector<MotionFitProblem::Reading> readings;
  for (const ImuSample& sample : imu) {
    const double seconds = seconds_between(origin, sample.time);
    if (seconds < 0 || seconds > duration) continue;
    readings.push_back({seconds, sample.angular_velocity, sample.acceleration});
  }
  require(imu.empty() || static_cast<double>(readings.size()) * options.max_gap > duration,
          "flight: {} inertial samples in {:.2f} s of ground truth are too few", readings.size(),
          duration);
  return {std::move(poses), std::move(readings), duration,
          knot_interval(part, !imu.empty(), options), options};
}

// --- the answer ---------------------------------------------------------------------------------

SplineMotion turned(const SplineMotion& motion, const Eigen::Quaterniond& rotation) {
  std::vector<SE3> control = motion.control();
  for (SE3& pose : control) pose = SE3(rotation, Eigen::Vector3d::Zero()) * pose;
  return {motion.begin(), motion.knot_interval(), std::move(control)};
}

// The part below a frequency, by a sinc under a Hann window of eight of its periods.
std::vector<Eigen::Vector3d> low_pass(const std::vector<Eigen::Vector3d>& values, double frequency,
                                      double rate) {
  const int reach = static_cast<int>(4 * rate / frequency);
  std::vector<double> kernel;
  for (int k = 0; k <= reach; ++k) {
    const double x = 2 * std::numbers::pi * frequency * k / rate;
    kernel.push_back((k == 0 ? 1 : std::sin(x) / x) *
                     (1 + std::cos(std::numbers::pi * k / (reach + 1))));
  }
  const int count = static_cast<int>(values.size());
  std::vector<Eigen::Vector3d> passed;
  for (int i = 0; i < count; ++i) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double total = 0;
    for (int k = std::max(0, i - reach); k <= std::min(count - 1, i + reach); ++k) {
      sum += kernel[std::abs(k - i)] * values[k];
      total += kernel[std::abs(k - i)];
    }
    passed.push_back(sum / total);
  }
  return passed;
}

// The largest root mean square of all stretches of so many values that half overlap.
double worst_stretch(const std::vector<Eigen::Vector3d>& values, std::size_t length) {
  if (values.size() <= length) return root_mean_square(values);
  double worst = 0;
  for (std::size_t begin = 0; begin + length <= values.size(); begin += (length + 1) / 2) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(begin);
    worst = std::max(worst, root_mean_square({first, first + static_cast<std::ptrdiff_t>(length)}));
  }
  return worst;
}

MotionFitResiduals summarize(const MotionFitProblem& problem) {
  const auto residuals = problem.residuals();
  const double rate = static_cast<double>(residuals.gyroscope.size()) / problem.motion().end();
  const auto slow_gyroscope = low_pass(residuals.gyroscope, kSlow, rate);
  const auto slow_accelerometer = low_pass(residuals.accelerometer, kSlow, rate);
  const auto stretch = std::max<std::size_t>(1, static_cast<std::size_t>(kStretch * rate));
  return {root_mean_square(residuals.position),   root_mean_square(residuals.rotation),
          root_mean_square(residuals.gyroscope),  root_mean_square(residuals.accelerometer),
          root_mean_square(slow_gyroscope),       root_mean_square(slow_accelerometer),
          worst_stretch(slow_gyroscope, stretch), worst_stretch(slow_accelerometer, stretch)};
}

}  // namespace

void MotionFitOptions::check() const {
  require(start >= 0 && duration >= 0, "flight: start and duration must not be negative");
  require(max_gap > 0, "flight: the longest gap must be positive");
  require(knot_interval >= 0.005 && knot_interval <= 1,
          "flight: the knot interval must lie between 5 ms and 1 s");
  require(gravity > 0, "flight: gravity must be positive");
  require(
      position_sigma > 0 && rotation_sigma > 0 && gyroscope_sigma > 0 && accelerometer_sigma > 0,
      "flight: standard deviations must be positive");
  require(bias_interval > 0, "flight: the interval of biases must be positive");
  require(max_iterations >= 1, "flight: needs an iteration or more");
}

FittedMotion fit_motion(const Trajectory& ground_truth, const std::vector<ImuSample>& imu,
                        const MotionFitOptions& options) {
  options.check();
  const Trajectory part = select(ground_truth, imu, options);
  MotionFitProblem problem = make_problem(part, imu, options);
  problem.solve();
  const Eigen::Vector3d down = problem.gravity();
  const auto upright = Eigen::Quaterniond::FromTwoVectors(down, -Eigen::Vector3d::UnitZ());
  return {turned(problem.motion(), upright), part.front().time, problem.time_offset(),
          so3_log(upright).norm(),           problem.biases(),  summarize(problem)};
}

ImuRecording real_imu(const FittedMotion& fit, const std::vector<ImuSample>& imu, Timestamp epoch) {
  ImuRecording recording;
  for (ImuSample sample : imu) {
    const double seconds = seconds_between(fit.origin, sample.time);
    if (seconds < fit.motion.begin() || seconds > fit.motion.end()) continue;
    sample.time += epoch - fit.origin;
    recording.samples.push_back(sample);
    recording.biases.push_back(bias_at(fit.biases, seconds));
  }
  return recording;
}

}  // namespace rover
