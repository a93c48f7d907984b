#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "rover/simulation/scene.h"

namespace rover {

class ThreadPool;

enum class SceneKind {
  kRoom,      // 8 x 6 x 3.5 m with furniture along its walls
  kHall,      // 24 x 16 x 7 m with pillars, shelves and stacks
  kCorridor,  // round a block of 24 x 16 m, back to its start
  kStreet,    // 110 m between houses
};

// "room", "hall", "corridor", "street". Throws InputError for others.
SceneKind parse_scene_kind(const std::string& name);

// Whether a texture is low: "rich" or "low". Throws InputError for others.
bool parse_low_texture(const std::string& name);

struct SceneOptions {
  SceneKind kind = SceneKind::kRoom;
  std::uint64_t seed = 0;
  bool low_texture = false;  // plain walls with few marks
  bool plain_leg = false;    // the same in the corridor's second leg alone
  int moving_objects = 0;
  // A folder of photographs to cover surfaces with instead of painted textures.
  std::optional<std::filesystem::path> photographs;
  // Positions along a flight that the scene (a room or a hall) is built around.
  std::vector<Eigen::Vector3d> around;

  // Throws InputError for values that make no sense.
  void check() const;
};

// Builds, paints and lights a scene: some seconds. The same for the same options, whatever the
// number of threads. Throws InputError where the folder of photographs holds no image.
Scene make_scene(const SceneOptions& options, ThreadPool& pool);

}  // namespace rover
