#include "rover/imu/rest.h"

#include <cmath>

#include "rover/base/error.h"

namespace rover {

void RestOptions::check() const {
  require(gyroscope > 0 && accelerometer > 0 && gravity > 0,
          "rest: gyroscope, accelerometer and gravity must be positive, not {}, {} and {}",
          gyroscope, accelerometer, gravity);
}

bool is_quiet(std::span<const ImuSample> samples, const ImuBias& bias, const RestOptions& options) {
  if (samples.empty()) return false;
  const auto count = static_cast<double>(samples.size());
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  double turning = 0, scatter = 0;
  for (const ImuSample& sample : samples) {
    turning += (sample.angular_velocity - bias.gyroscope).squaredNorm() / count;
    force += sample.acceleration / count;
  }
  for (const ImuSample& sample : samples) {
    scatter += (sample.acceleration - force).squaredNorm() / count;
  }
  return std::sqrt(turning) < options.gyroscope && std::sqrt(scatter) < options.accelerometer &&
         std::abs((force - bias.accelerometer).norm() - kGravity) < options.gravity;
}

}  // namespace rover
