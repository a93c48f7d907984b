#pragma once

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <zlib.h>

#include "rover/imu/imu_buffer.h"
#include "rover/imu/inertial_state.h"

namespace rover {

// Recorded EuRoC flights with true states, for tests: beside a developer's checkout (see the README
// of the shared data).
struct RealFlight {
  std::vector<Timestamp> times;       // of the states, 200 Hz
  std::vector<InertialState> states;  // true ones, in the frame of the ground truth
  ImuBuffer imu;
};

inline std::filesystem::path real_flights_folder() {
  return std::filesystem::path(ROVER_SOURCE_DIR) / "../shared/data/euroc_imu_gt";
}

// Those with velocities and biases at 200 Hz.
inline const std::vector<std::string>& real_flight_names() {
  static const std::vector<std::string> names = {
      "MH_04_difficult", "MH_05_difficult", "V1_02_medium",   "V1_03_difficult",
      "V2_01_easy",      "V2_02_medium",    "V2_03_difficult"};
  return names;
}

inline ImuCalibration euroc_imu() { return {1.6968e-4, 1.9393e-5, 2e-3, 3e-3, 200}; }

// Rows of a packed file of comma-separated numbers: the stamp, then the values.
struct StampedRow {
  Timestamp time = 0;
  std::vector<double> values;
};

inline std::vector<StampedRow> read_packed_rows(const std::filesystem::path& file) {
  std::vector<StampedRow> rows;
  const gzFile input = gzopen(file.c_str(), "rb");
  if (!input) return rows;
  char line[1024];
  while (gzgets(input, line, sizeof(line))) {
    if (line[0] < '0' || line[0] > '9') continue;
    char* at = nullptr;
    StampedRow row;
    row.time = std::strtoll(line, &at, 10);
    while (*at == ',') row.values.push_back(std::strtod(at + 1, &at));
    rows.push_back(row);
  }
  gzclose(input);
  return rows;
}

inline RealFlight read_real_flight(const std::string& name) {
  RealFlight flight;
  const auto folder = real_flights_folder() / name;
  const auto three = [](const std::vector<double>& v, std::size_t at) {
    return Eigen::Vector3d(v[at], v[at + 1], v[at + 2]);
  };
  for (const auto& [time, v] : read_packed_rows(folder / "imu0/data.csv.gz"))
    flight.imu.add({time, three(v, 0), three(v, 3)});
  for (const auto& [time, v] :
       read_packed_rows(folder / "state_groundtruth_estimate0/data.csv.gz")) {
    flight.times.push_back(time);
    const Eigen::Quaterniond rotation(v[3], v[4], v[5], v[6]);
    flight.states.push_back(
        {{rotation.normalized(), three(v, 0)}, three(v, 7), {three(v, 10), three(v, 13)}});
  }
  return flight;
}

}  // namespace rover
