#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "rover/simulation/imu_synthesis.h"
#include "rover/simulation/motion.h"

namespace rover {

// Writes data.csv and sensor.yaml of an EuRoC `imu0` folder, which must exist. The sensor's frame
// is the body's. Throws InputError if a file cannot be written.
void write_imu_folder(const std::filesystem::path& folder, const ImuRecording& recording,
                      const ImuCalibration& calibration);

// What a motion capture system would get wrong. None by default: the truth is exact.
struct ReferenceError {
  double position = 0;       // m, rms over all three axes
  double correlation = 0.2;  // s: the error is a Gauss-Markov process
  std::uint64_t seed = 0;
};

// Writes data.csv and sensor.yaml of an EuRoC `state_groundtruth_estimate0` folder, which must
// exist: pose, velocity and biases at each inertial sample. Seconds 0 of the motion is at `epoch`;
// samples outside the motion have no row.
void write_ground_truth_folder(const std::filesystem::path& folder, const Motion& motion,
                               Timestamp epoch, const ImuRecording& recording,
                               const ReferenceError& error = {});

}  // namespace rover
