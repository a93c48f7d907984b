#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace rover {

struct ColoredPoint {
  Eigen::Vector3d position;
  std::array<std::uint8_t, 3> color;  // red, green, blue
};

// Reads map.ply as `rover run` writes it: binary little endian, vertices of three floats and three
// bytes. Throws InputError for anything else.
std::vector<ColoredPoint> read_point_cloud(const std::filesystem::path& file);

// A drawing (see svg.h) of a map from above and from the side, like draw_trajectories: points as an
// embedded picture, darker where there are more, and places (the keyframes) on top. Points far off
// (beyond the 99% quantile by half the extent) are left out.
std::string draw_map(const std::vector<Eigen::Vector3d>& points,
                     const std::vector<Eigen::Vector3d>& places);

}  // namespace rover
