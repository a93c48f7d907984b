#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rover/imu/imu_sample.h"

namespace rover {

// Reads "nanoseconds,wx,wy,wz,ax,ay,az" per line, as EuRoC and TUM-VI write inertial data. Lines
// that cannot be read, and samples whose time does not increase, are left out and described in
// `notes` if it is given. Throws InputError if the file cannot be read or is mostly not of this
// format.
std::vector<ImuSample> read_imu_file(const std::filesystem::path& file,
                                     std::vector<std::string>* notes = nullptr);

}  // namespace rover
