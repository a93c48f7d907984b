#include "rover/simulation/inertial_files.h"

#include <cmath>
#include <iterator>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "rover/base/random.h"
#include "rover/datasets/atomic_file.h"

namespace rover {
namespace {

constexpr std::string_view kImuHeader =
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";

constexpr std::string_view kStateHeader =
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], "
    "q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], "
    "v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], "
    "b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], "
    "b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n";

constexpr std::string_view kIdentity =
    "T_BS:\n"
    "  cols: 4\n"
    "  rows: 4\n"
    "  data: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]\n";

// Rounded to a billionth of the unit, below what any sensor resolves.
void append_vector(std::string& text, const Eigen::Vector3d& v) {
  fmt::format_to(std::back_inserter(text), ",{:.9f},{:.9f},{:.9f}", v.x(), v.y(), v.z());
}

std::string imu_rows(const ImuRecording& recording) {
  std::string text(kImuHeader);
  for (const ImuSample& sample : recording.samples) {
    text += std::to_string(sample.time);
    append_vector(text, sample.angular_velocity);
    append_vector(text, sample.acceleration);
    text += '\n';
  }
  return text;
}

void append_state(std::string& text, Timestamp time, const MotionState& state) {
  const Eigen::Quaterniond& q = state.world_from_body.rotation;
  text += std::to_string(time);
  append_vector(text, state.world_from_body.translation);
  fmt::format_to(std::back_inserter(text), ",{:.9f}", q.w());
  append_vector(text, q.vec());
  append_vector(text, state.velocity);
}

// The error of a motion capture system, sample by sample.
class ReferenceNoise {
 public:
  explicit ReferenceNoise(const ReferenceError& error) : error_(error), random_(error.seed) {}

  Eigen::Vector3d at(double seconds) {
    const double kept = std::exp(-(seconds - last_) / error_.correlation);
    const double drawn = error_.position / std::sqrt(3.0) * std::sqrt(1 - kept * kept);
    for (double& axis : value_) axis = kept * axis + drawn * random_.gaussian();
    last_ = seconds;
    return value_;
  }

 private:
  ReferenceError error_;
  Random random_;
  double last_ = -1e3;  // long ago: the first value has the whole variance
  Eigen::Vector3d value_ = Eigen::Vector3d::Zero();
};

std::string state_rows(const Motion& motion, Timestamp epoch, const ImuRecording& recording,
                       const ReferenceError& error) {
  ReferenceNoise noise(error);
  std::string text(kStateHeader);
  for (std::size_t i = 0; i < recording.samples.size(); ++i) {
    const Timestamp time = recording.samples[i].time;
    const double seconds = seconds_between(epoch, time);
    if (seconds < motion.begin() || seconds > motion.end()) continue;
    MotionState state = motion.at(seconds);
    state.world_from_body.translation += noise.at(seconds);
    append_state(text, time, state);
    append_vector(text, recording.biases[i].gyroscope);
    append_vector(text, recording.biases[i].accelerometer);
    text += '\n';
  }
  return text;
}

std::string imu_description(const ImuCalibration& imu) {
  return fmt::format(
      "%YAML:1.0\n"
      "sensor_type: imu\n"
      "comment: simulated\n"
      "{}"
      "rate_hz: {}\n"
      "gyroscope_noise_density: {}      # rad / s / sqrt(Hz)\n"
      "gyroscope_random_walk: {}        # rad / s^2 / sqrt(Hz)\n"
      "accelerometer_noise_density: {}  # m / s^2 / sqrt(Hz)\n"
      "accelerometer_random_walk: {}    # m / s^3 / sqrt(Hz)\n",
      kIdentity, imu.rate, imu.gyroscope_noise, imu.gyroscope_walk, imu.accelerometer_noise,
      imu.accelerometer_walk);
}

}  // namespace

void write_imu_folder(const std::filesystem::path& folder, const ImuRecording& recording,
                      const ImuCalibration& calibration) {
  write_file_atomically(folder / "sensor.yaml", imu_description(calibration));
  write_file_atomically(folder / "data.csv", imu_rows(recording));
}

void write_ground_truth_folder(const std::filesystem::path& folder, const Motion& motion,
                               Timestamp epoch, const ImuRecording& recording,
                               const ReferenceError& error) {
  write_file_atomically(folder / "sensor.yaml",
                        fmt::format("%YAML:1.0\n"
                                    "sensor_type: visual-inertial\n"
                                    "comment: states of the simulated body, positions {} m off\n{}",
                                    error.position, kIdentity));
  write_file_atomically(folder / "data.csv", state_rows(motion, epoch, recording, error));
}

}  // namespace rover
