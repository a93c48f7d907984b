#include "rover/simulation/imu_synthesis.h"

#include <cmath>

#include "rover/base/error.h"
#include "rover/geometry/random_geometry.h"

namespace rover {
namespace {

// What the random numbers are for: the draws of one sensor do not depend on those of the other.
enum Purpose : std::uint64_t { kGyroscope = 1, kAccelerometer = 2 };

// One triad of sensors: a bias that walks, and white noise. Deviations of the discrete samples
// follow from the densities (Crassidis, "Sigma-point Kalman filtering for integrated GPS and
// inertial navigation", 2006).
class NoisyTriad {
 public:
  NoisyTriad(double noise_density, double walk_density, double bias_deviation, double rate,
             Random random)
      : noise_(noise_density * std::sqrt(rate)),
        walk_(walk_density / std::sqrt(rate)),
        random_(random),
        bias_(bias_deviation * random_gaussian_vector(random_)) {}

  const Eigen::Vector3d& bias() const { return bias_; }
  Eigen::Vector3d read(const Eigen::Vector3d& exact) {
    return exact + bias_ + noise_ * random_gaussian_vector(random_);
  }
  void step() { bias_ += walk_ * random_gaussian_vector(random_); }

 private:
  double noise_, walk_;
  Random random_;
  Eigen::Vector3d bias_;
};

NoisyTriad make_gyroscope(const ImuSynthesisOptions& options) {
  const double on = options.noise ? 1 : 0;
  const ImuCalibration& imu = options.calibration;
  return {on * imu.gyroscope_noise, on * imu.gyroscope_walk, on * options.gyroscope_bias, imu.rate,
          Random(hash_seed(options.seed, kGyroscope))};
}

NoisyTriad make_accelerometer(const ImuSynthesisOptions& options) {
  const double on = options.noise ? 1 : 0;
  const ImuCalibration& imu = options.calibration;
  return {on * imu.accelerometer_noise, on * imu.accelerometer_walk,
          on * options.accelerometer_bias, imu.rate,
          Random(hash_seed(options.seed, kAccelerometer))};
}

}  // namespace

void ImuSynthesisOptions::check() const {
  require(calibration.rate >= 1 && calibration.rate <= 100000,
          "inertial data: the rate must lie between 1 Hz and 100 kHz");
  require(calibration.gyroscope_noise >= 0 && calibration.gyroscope_walk >= 0 &&
              calibration.accelerometer_noise >= 0 && calibration.accelerometer_walk >= 0,
          "inertial data: noise densities must not be negative");
  require(gyroscope_bias >= 0 && accelerometer_bias >= 0,
          "inertial data: deviations of the biases must not be negative");
  require(gravity >= 0 && std::isfinite(gravity), "inertial data: gravity must not be negative");
}

ImuRecording synthesize_imu(const Motion& motion, Timestamp epoch,
                            const ImuSynthesisOptions& options) {
  options.check();
  NoisyTriad gyroscope = make_gyroscope(options), accelerometer = make_accelerometer(options);
  const Eigen::Vector3d gravity(0, 0, -options.gravity);
  const double rate = options.calibration.rate;
  const auto count = static_cast<int>(std::floor((motion.end() - motion.begin()) * rate + 1e-9));
  ImuRecording recording;
  for (int i = 0; i <= count; ++i, gyroscope.step(), accelerometer.step()) {
    const double seconds = std::min(motion.begin() + i / rate, motion.end());
    const MotionState state = motion.at(seconds);
    const Eigen::Vector3d force =
        state.world_from_body.rotation.conjugate() * (state.acceleration - gravity);
    recording.biases.push_back({gyroscope.bias(), accelerometer.bias()});
    recording.samples.push_back({epoch + from_seconds(seconds),
                                 gyroscope.read(state.angular_velocity),
                                 accelerometer.read(force)});
  }
  return recording;
}

}  // namespace rover
