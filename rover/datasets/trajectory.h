#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rover/base/timestamp.h"
#include "rover/geometry/se3.h"

namespace rover {

// Where a frame (a camera, or the body of a robot) was at one instant.
struct StampedPose {
  Timestamp time = 0;
  SE3 pose;  // world_from_frame, metres
};

// Poses in order of strictly increasing time.
using Trajectory = std::vector<StampedPose>;

// Reads "seconds tx ty tz qx qy qz qw" per line; '#' begins a comment. Lines that cannot be read,
// and poses whose time does not increase, are left out and described in `notes` if it is given.
// Throws InputError if the file cannot be read, holds no pose, or is mostly not of this format.
Trajectory read_tum_trajectory(const std::filesystem::path& file,
                               std::vector<std::string>* notes = nullptr);

// Reads a ground truth of EuRoC: "nanoseconds,tx,ty,tz,qw,qx,qy,qz" per line and whatever follows.
// Otherwise as above.
Trajectory read_euroc_trajectory(const std::filesystem::path& file,
                                 std::vector<std::string>* notes = nullptr);

// Either of them: EuRoC's where the name, but for a last ".gz", ends in ".csv".
Trajectory read_trajectory(const std::filesystem::path& file,
                           std::vector<std::string>* notes = nullptr);

// The TUM format with nine decimals.
std::string format_tum_trajectory(const Trajectory& trajectory);

// Writes it under a temporary name and renames: the file is whole or absent. Throws InputError.
void write_tum_trajectory(const std::filesystem::path& file, const Trajectory& trajectory);

// Poses of another frame that is rigidly joined: world_from_other = world_from_frame
// * frame_from_other.
Trajectory move_frame(const Trajectory& trajectory, const SE3& frame_from_other);

}  // namespace rover
