#include "rover/imu/imu_check.h"

#include <algorithm>
#include <cmath>

#include "rover/base/error.h"
#include "rover/base/quantile.h"
#include "rover/imu/inertial_state.h"

namespace rover {
namespace {

bool is_finite(const ImuSample& sample) {
  return sample.angular_velocity.allFinite() && sample.acceleration.allFinite();
}

// The samples that can be used, in order; counts the others.
std::vector<ImuSample> usable_samples(std::span<const ImuSample> samples, ImuReport& report) {
  std::vector<ImuSample> good;
  good.reserve(samples.size());
  for (const ImuSample& sample : samples) {
    if (!is_finite(sample)) {
      ++report.not_finite;
    } else if (!good.empty() && sample.time <= good.back().time) {
      ++report.out_of_order;
    } else {
      good.push_back(sample);
    }
  }
  return good;
}

void judge_times(const std::vector<ImuSample>& samples, const ImuCheckOptions& options,
                 ImuReport& report) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < samples.size(); ++i)
    steps.push_back(seconds_between(samples[i - 1].time, samples[i].time));
  const double usual = quantile(steps, 0.5);
  report.rate = 1 / usual;
  report.duration = seconds_between(samples.front().time, samples.back().time);
  for (const double step : steps) {
    if (step <= std::max(options.gap, 3 * usual)) continue;
    ++report.gaps;
    report.longest_gap = std::max(report.longest_gap, step);
  }
}

void measure(const std::vector<ImuSample>& samples, ImuReport& report) {
  std::vector<double> accelerations, rates;
  for (const ImuSample& sample : samples) {
    accelerations.push_back(sample.acceleration.norm());
    rates.push_back(sample.angular_velocity.norm());
  }
  report.median_acceleration = quantile(accelerations, 0.5);
  report.high_angular_velocity = quantile(rates, 0.95);
}

// Mean and standard deviation per axis of a stretch.
struct Scatter {
  Vector6d mean = Vector6d::Zero();
  double gyroscope = 0;
  double accelerometer = 0;
};

Scatter scatter_of(std::span<const ImuSample> samples) {
  Scatter scatter;
  const auto count = static_cast<double>(samples.size());
  const auto reading = [](const ImuSample& s) {
    return ImuBias{s.angular_velocity, s.acceleration}.vector();
  };
  for (const ImuSample& sample : samples) scatter.mean += reading(sample) / count;
  Vector6d variance = Vector6d::Zero();
  for (const ImuSample& sample : samples)
    variance += (reading(sample) - scatter.mean).cwiseAbs2() / (count - 1);
  scatter.gyroscope = std::sqrt(variance.head<3>().mean());
  scatter.accelerometer = std::sqrt(variance.tail<3>().mean());
  return scatter;
}

std::optional<ImuRest> find_rest(const std::vector<ImuSample>& samples,
                                 const ImuCheckOptions& options, double rate) {
  const auto window = static_cast<std::size_t>(std::max(10.0, options.rest_window * rate));
  std::optional<ImuRest> rest;
  double quietest = options.rest_accelerometer;
  for (std::size_t i = 0; i + window <= samples.size(); i += window / 2) {
    const Scatter scatter = scatter_of({samples.data() + i, window});
    if (scatter.gyroscope > options.rest_gyroscope || scatter.accelerometer > quietest) continue;
    quietest = scatter.accelerometer;
    rest = ImuRest{samples[i].time, scatter.mean.tail<3>().norm(), scatter.mean.head<3>(),
                   scatter.gyroscope / std::sqrt(rate), scatter.accelerometer / std::sqrt(rate)};
  }
  return rest;
}

template <class... Args>
void warn(ImuReport& report, fmt::format_string<Args...> format, Args&&... args) {
  report.warnings.push_back(fmt::format(format, std::forward<Args>(args)...));
}

void warn_of_times(ImuReport& report) {
  if (report.not_finite > 0)
    warn(report, "{} samples are not numbers: left out", report.not_finite);
  if (report.out_of_order > 0)
    warn(report, "{} samples are not later than the one before: left out; look at the clock",
         report.out_of_order);
  if (report.gaps > 0)
    warn(report, "{} gaps in the samples, the longest of {:.3f} s: the motion there is a guess",
         report.gaps, report.longest_gap);
}

void warn_of_units(ImuReport& report) {
  const double force = report.median_acceleration;
  if (force > 0.5 && force < 2)
    warn(report, "accelerations have a median of {:.2f}: they look like g, m/s^2 are expected",
         force);
  else if (force < 7 || force > 13)
    warn(report,
         "accelerations have a median of {:.2f} m/s^2, far from 9.81: wrong unit, or gravity was "
         "taken off; the raw specific force is expected",
         force);
  if (report.high_angular_velocity > 15)
    warn(report,
         "one angular velocity in twenty is above {:.1f}: they look like deg/s, rad/s are expected",
         report.high_angular_velocity);
}

void warn_of_rest(const ImuCalibration& calibration, ImuReport& report) {
  if (calibration.rate > 0 && std::abs(report.rate / calibration.rate - 1) > 0.2)
    warn(report, "samples come at {:.1f} Hz, but the calibration says {:.1f} Hz", report.rate,
         calibration.rate);
  if (!report.rest) return;
  const ImuRest& rest = *report.rest;
  if (rest.gyroscope_density > 10 * calibration.gyroscope_noise)
    warn(report,
         "at rest the gyroscope's noise is {:.2g} rad/s/sqrt(Hz), {:.0f} times what is "
         "configured",
         rest.gyroscope_density, rest.gyroscope_density / calibration.gyroscope_noise);
  if (rest.accelerometer_density > 10 * calibration.accelerometer_noise)
    warn(report,
         "at rest the accelerometer's noise is {:.2g} m/s^2/sqrt(Hz), {:.0f} times what is "
         "configured",
         rest.accelerometer_density, rest.accelerometer_density / calibration.accelerometer_noise);
}

}  // namespace

void ImuCheckOptions::check() const {
  require(gap > 0, "imu check: gap must be positive, not {} s", gap);
  require(rest_window > 0, "imu check: rest_window must be positive, not {} s", rest_window);
  require(rest_gyroscope > 0 && rest_accelerometer > 0,
          "imu check: limits of rest must be positive, not {} rad/s and {} m/s^2", rest_gyroscope,
          rest_accelerometer);
}

ImuReport check_imu(std::span<const ImuSample> samples, const ImuCalibration* calibration,
                    const ImuCheckOptions& options) {
  options.check();
  ImuReport report;
  report.samples = static_cast<int>(samples.size());
  const std::vector<ImuSample> good = usable_samples(samples, report);
  if (good.size() < 2) {
    warn(report, "there are {} usable inertial samples: too few for anything", good.size());
    return report;
  }
  judge_times(good, options, report);
  measure(good, report);
  report.rest = find_rest(good, options, report.rate);
  warn_of_times(report);
  warn_of_units(report);
  if (calibration) warn_of_rest(*calibration, report);
  return report;
}

}  // namespace rover
