#pragma once

#include <filesystem>

#include "rover/map/map.h"

namespace rover {

// Writes landmarks (gray) and keyframe positions (red) as a binary point cloud that MeshLab,
// CloudCompare and Open3D read.
// Without a map (null) the cloud is empty.
void write_map_ply(const std::filesystem::path& file, const Map* map);

}  // namespace rover
