#include "rover/cli/map_ply.h"

#include <array>
#include <bit>
#include <cstring>
#include <string>

#include <fmt/format.h>

#include "rover/datasets/atomic_file.h"

namespace rover {
namespace {

using Color = std::array<std::uint8_t, 3>;

void append_vertex(const Eigen::Vector3d& point, const Color& color, std::string& data) {
  static_assert(std::endian::native == std::endian::little);
  const Eigen::Vector3f position = point.cast<float>();
  const std::size_t begin = data.size();
  data.resize(begin + 3 * sizeof(float));
  std::memcpy(data.data() + begin, position.data(), 3 * sizeof(float));
  for (const std::uint8_t channel : color) data.push_back(static_cast<char>(channel));
}

Color landmark_color(const Landmark& landmark) {
  if (!landmark.appearance->has_patch) return {128, 128, 128};
  const auto& pixels = landmark.appearance->patch.pixels;
  const std::uint8_t gray = pixels[pixels.size() / 2];
  return {gray, gray, gray};
}

void append_map(const Map& map, std::string& data) {
  for (const Landmark& landmark : map.landmarks()) {
    append_vertex(landmark.position, landmark_color(landmark), data);
  }
  for (const Keyframe& keyframe : map.keyframes()) {
    append_vertex(keyframe.world_from_body().translation, {255, 0, 0}, data);
  }
}

}  // namespace

void write_map_ply(const std::filesystem::path& file, const Map* map) {
  std::string data = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment Rover map: landmarks in the gray of their "
      "patch, keyframes red\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
      "end_header\n",
      map ? map->landmarks().size() + map->keyframes().size() : 0);
  if (map) append_map(*map, data);
  write_file_atomically(file, data);
}

}  // namespace rover
