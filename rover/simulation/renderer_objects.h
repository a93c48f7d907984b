#pragma once

#include <array>
#include <optional>
#include <vector>

#include "rover/simulation/renderer.h"
#include "rover/simulation/scene.h"
#include "rover/simulation/scene_rays.h"

namespace rover {

// The moving objects of a scene at the time of one shot, lit by the lamps that reach them there.
class LitObjects {
 public:
  LitObjects(const Scene& scene, const SceneRays& casters, const Shot& shot);

  // The radiance of the nearest object that ray i meets before what it hit in the scene; nothing if
  // there is none. footprint: rad.
  std::optional<float> hit(const SceneRays::Packet& rays, int i, float footprint) const;

 private:
  struct Object {
    Eigen::Matrix3f object_from_world;  // rotation
    Eigen::Vector3f position, half_size;
    std::array<float, 6> irradiance{};
    std::array<const Texture*, 6> textures{};
  };
  // Which face, and where on it, a ray enters.
  struct Entry {
    float distance;
    int face;
    Eigen::Vector3f point;  // in the object's frame, in half sizes
  };
  static std::optional<Entry> enter(const Object& object, const Eigen::Vector3f& origin,
                                    const Eigen::Vector3f& direction);
  static float radiance(const Object& object, const Entry& entry, float footprint);

  std::vector<Object> objects_;
};

}  // namespace rover
