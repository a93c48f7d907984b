#include "rover/diagnosis/axis_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/SVD>

#include "rover/imu/inertial_state.h"

namespace rover {
namespace {

constexpr double kStretch = 0.2;         // s, of one comparison
constexpr double kLongestStretch = 0.5;  // s
constexpr double kGridStep = 0.005;      // s
constexpr std::size_t kMinStretches = 10;
// A mirrored sensor is a rarer mistake than a turned one: it must fit better by this much.
constexpr double kMirrorPenalty = 0.01;

using Vectors = std::vector<Eigen::Vector3d>;

// All 48, the identity first.
std::vector<Eigen::Matrix3d> axis_choices() {
  std::vector<Eigen::Matrix3d> choices;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) axes(row, order[row]) = (signs >> row) & 1 ? -1 : 1;
      choices.push_back(axes);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return choices;
}

Eigen::Vector3d mean_of(const Vectors& vectors) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& vector : vectors) sum += vector;
  return sum / static_cast<double>(vectors.size());
}

void remove_mean(Vectors& vectors) {
  const Eigen::Vector3d mean = mean_of(vectors);
  for (Eigen::Vector3d& vector : vectors) vector -= mean;
}

double energy(const Vectors& vectors) {
  double sum = 0;
  for (const Eigen::Vector3d& vector : vectors) sum += vector.squaredNorm();
  return sum;
}

// From one pose to another, the shortest stretches that last for kStretch.
struct Stretch {
  Timestamp from = 0, to = 0;
  Eigen::Vector3d turn;  // rad, rotation vector in the body's axes
};

std::vector<Stretch> stretches_of(const Trajectory& camera,
                                  const Eigen::Quaterniond& body_from_camera) {
  std::vector<Stretch> stretches;
  std::size_t from = 0;
  for (std::size_t i = 1; i < camera.size(); ++i) {
    const double length = seconds_between(camera[from].time, camera[i].time);
    if (length < kStretch - 1e-3) continue;
    const Eigen::Quaterniond turn =
        camera[from].pose.rotation.conjugate() * camera[i].pose.rotation;
    if (length < kLongestStretch)
      stretches.push_back({camera[from].time, camera[i].time, body_from_camera * so3_log(turn)});
    from = i;
  }
  return stretches;
}

// The mean reading over a stretch of time. Linear in the readings: no unit is assumed.
std::optional<Eigen::Vector3d> mean_rate(const ImuBuffer& imu, Timestamp from, Timestamp to) {
  const std::vector<ImuSample> samples = imu.between(from, to);
  if (samples.empty()) return std::nullopt;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i < samples.size(); ++i)
    sum += 0.5 * seconds_between(samples[i - 1].time, samples[i].time) *
           (samples[i - 1].angular_velocity + samples[i].angular_velocity);
  return sum / seconds_between(from, to);
}

// What both sensors say of the same stretches, without means (those of the readings hold the bias).
struct Rates {
  Vectors seen, read;
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  double norm = 0;

  bool enough() const { return seen.size() >= kMinStretches && norm > 0; }
  // Whatever rotation or mirroring would bring the readings to what was seen.
  double any_orientation() const {
    return Eigen::JacobiSVD<Eigen::Matrix3d>(products).singularValues().sum() / norm;
  }
  double correlation(const Eigen::Matrix3d& axes) const {
    return axes.cwiseProduct(products).sum() / norm;
  }
};

Rates rates_at(const std::vector<Stretch>& stretches, const ImuBuffer& imu, double offset) {
  Rates rates;
  const Timestamp shift = from_seconds(offset);
  for (const Stretch& stretch : stretches) {
    const auto read = mean_rate(imu, stretch.from + shift, stretch.to + shift);
    if (!read) continue;
    rates.read.push_back(*read);
    rates.seen.push_back(stretch.turn / seconds_between(stretch.from, stretch.to));
  }
  if (rates.seen.size() < kMinStretches || 2 * rates.seen.size() < stretches.size()) return {};
  remove_mean(rates.seen);
  remove_mean(rates.read);
  for (std::size_t i = 0; i < rates.seen.size(); ++i)
    rates.products += rates.seen[i] * rates.read[i].transpose();
  rates.norm = std::sqrt(energy(rates.seen) * energy(rates.read));
  return rates;
}

// Where the visual second differences of positions were taken.
struct Acceleration {
  Timestamp from = 0, to = 0;
  Eigen::Vector3d seen;  // in the camera's world and scale
};

std::vector<Acceleration> accelerations_of(const Trajectory& camera) {
  std::vector<Acceleration> result;
  for (std::size_t i = 1; i + 1 < camera.size(); ++i) {
    // The poses nearest to kStretch before and behind, if they are equally far.
    std::size_t a = i, b = i;
    while (a > 0 && seconds_between(camera[a].time, camera[i].time) < kStretch - 1e-3) --a;
    while (b + 1 < camera.size() &&
           seconds_between(camera[i].time, camera[b].time) < kStretch - 1e-3)
      ++b;
    const double before = seconds_between(camera[a].time, camera[i].time);
    const double behind = seconds_between(camera[i].time, camera[b].time);
    if (before < kStretch - 1e-3 || before > kLongestStretch ||
        std::abs(before - behind) > 0.1 * kStretch)
      continue;
    const Eigen::Vector3d change =
        camera[b].pose.translation - 2 * camera[i].pose.translation + camera[a].pose.translation;
    result.push_back({camera[a].time, camera[b].time, change / (before * behind)});
  }
  return result;
}

Eigen::Quaterniond rotation_at(const Trajectory& camera, Timestamp time) {
  const auto next =
      std::lower_bound(camera.begin(), camera.end(), time,
                       [](const StampedPose& pose, Timestamp t) { return pose.time < t; });
  if (next == camera.begin()) return next->pose.rotation;
  if (next == camera.end()) return camera.back().pose.rotation;
  const StampedPose& last = *std::prev(next);
  const double share = seconds_between(last.time, time) / seconds_between(last.time, next->time);
  return last.pose.rotation.slerp(share, next->pose.rotation);
}

// Readings in the camera's world under each choice of axes: the mean over the stretch with the
// weights (a triangle) that a second difference of positions has.
std::vector<Eigen::Vector3d> readings_of(const Trajectory& camera,
                                         const Eigen::Quaterniond& body_from_camera,
                                         const std::vector<ImuSample>& samples,
                                         const std::vector<Eigen::Matrix3d>& choices) {
  std::vector<Eigen::Vector3d> sums(choices.size(), Eigen::Vector3d::Zero());
  const double half = 0.5 * seconds_between(samples.front().time, samples.back().time);
  double weights = 0;
  for (const ImuSample& sample : samples) {
    const double at = seconds_between(samples.front().time, sample.time);
    const double weight = std::max(0.0, 1 - std::abs(at / half - 1));
    const Eigen::Matrix3d world_from_body =
        (rotation_at(camera, sample.time) * body_from_camera.conjugate()).toRotationMatrix();
    for (std::size_t i = 0; i < choices.size(); ++i)
      sums[i] += weight * (world_from_body * (choices[i] * sample.acceleration));
    weights += weight;
  }
  for (Eigen::Vector3d& sum : sums) sum /= weights;
  return sums;
}

// reading = scale * seen - gravity by least squares, the scale not negative: returns what is left,
// rms of one axis, as if gravity were 9.81, and gravity's length.
std::pair<double, double> residual_of(Vectors seen, Vectors readings) {
  const double gravity = mean_of(readings).norm();
  remove_mean(seen);
  remove_mean(readings);
  double product = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) product += seen[i].dot(readings[i]);
  const double power = energy(seen);
  const double scale = power > 0 ? std::max(0.0, product / power) : 0;
  double sum = 0;
  for (std::size_t i = 0; i < seen.size(); ++i)
    sum += (readings[i] - scale * seen[i]).squaredNorm();
  const double rms = std::sqrt(sum / (3 * static_cast<double>(seen.size())));
  return {gravity > 0 ? rms * kGravity / gravity : HUGE_VAL, gravity};
}

}  // namespace

std::string describe_axes(const Eigen::Matrix3d& axes) {
  std::string text;
  for (int row = 0; row < 3; ++row) {
    Eigen::Index column = 0;
    axes.row(row).cwiseAbs().maxCoeff(&column);
    text += std::string(row ? ", " : "(") + (axes(row, column) < 0 ? "-" : "") + "xyz"[column];
  }
  return text + ")";
}

std::optional<GyroscopeFit> fit_gyroscope(const Trajectory& camera,
                                          const Eigen::Quaterniond& body_from_camera,
                                          const ImuBuffer& imu, double max_offset) {
  const std::vector<Stretch> stretches = stretches_of(camera, body_from_camera);
  Rates best;
  GyroscopeFit fit;
  const int steps = static_cast<int>(max_offset / kGridStep);
  for (int i = -steps; i <= steps; ++i) {
    Rates rates = rates_at(stretches, imu, i * kGridStep);
    if (!rates.enough() || rates.any_orientation() <= fit.any_orientation) continue;
    fit.any_orientation = rates.any_orientation();
    fit.time_offset = i * kGridStep;
    best = std::move(rates);
  }
  if (!best.enough()) return std::nullopt;
  const auto choices = axis_choices();
  const auto merit = [&](const Eigen::Matrix3d& axes) {
    return best.correlation(axes) - (axes.determinant() < 0 ? kMirrorPenalty : 0);
  };
  fit.axes = *std::max_element(choices.begin(), choices.end(),
                               [&](const auto& a, const auto& b) { return merit(a) < merit(b); });
  fit.correlation = best.correlation(fit.axes);
  fit.as_given = best.correlation(choices.front());
  fit.scale = std::sqrt(energy(best.seen) / energy(best.read));
  fit.motion = std::sqrt(energy(best.seen) / static_cast<double>(best.seen.size()));
  return fit;
}

std::optional<AccelerometerFit> fit_accelerometer(const Trajectory& camera,
                                                  const Eigen::Quaterniond& body_from_camera,
                                                  const ImuBuffer& imu) {
  const auto choices = axis_choices();
  Vectors seen;
  std::vector<Vectors> readings(choices.size());
  for (const Acceleration& acceleration : accelerations_of(camera)) {
    const auto samples = imu.between(acceleration.from, acceleration.to);
    if (samples.empty()) continue;
    const auto all = readings_of(camera, body_from_camera, samples, choices);
    for (std::size_t i = 0; i < choices.size(); ++i) readings[i].push_back(all[i]);
    seen.push_back(acceleration.seen);
  }
  if (seen.size() < kMinStretches) return std::nullopt;
  AccelerometerFit fit;
  fit.residual = HUGE_VAL;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    const auto [residual, gravity] = residual_of(seen, readings[i]);
    if (i == 0) fit.as_given = residual;
    if (residual >= fit.residual) continue;
    fit.residual = residual;
    fit.gravity = gravity;
    fit.axes = choices[i];
  }
  return fit;
}

}  // namespace rover
