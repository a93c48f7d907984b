#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "rover/geometry/se3.h"
#include "rover/simulation/flight_volume.h"
#include "rover/simulation/scene_lighting.h"
#include "rover/simulation/texture.h"

namespace rover {

// A flat parallelogram with a texture of its own; seen from both sides. The texture's upper left
// corner is at `origin`, its rows run along `edge_u`, its columns along `edge_v`. Metres, world.
struct Patch {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  Eigen::Vector3f edge_u = Eigen::Vector3f::UnitX();
  Eigen::Vector3f edge_v = Eigen::Vector3f::UnitY();
  int texture = 0;           // index into Scene::textures
  float emission = 0;        // the radiance it gives off itself where its texture is white
  bool casts_shadow = true;  // not what lies flat on another patch

  // Towards whom the texture is not mirrored.
  Eigen::Vector3f normal() const { return edge_v.cross(edge_u).normalized(); }
};

// A box that moves: along a circle around `centre`, turning with it. Its six faces are textured in
// the order -x +x -y +y -z +z of its own axes.
struct MovingObject {
  Eigen::Vector3d half_size = Eigen::Vector3d::Ones();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 1;         // m
  double angular_speed = 1;  // rad/s
  double phase = 0;          // rad
  std::vector<int> textures;

  SE3 world_from_object(double seconds) const;
};

// Everything that can be seen. Radiance 1 is a white surface under an irradiance of 1; where
// flights go, scenes have about that.
struct Scene {
  std::vector<Patch> patches;
  std::vector<Texture> textures;
  Lighting lighting;
  std::vector<Lamp> lamps;
  float ambient = 0.3F;  // what comes to unobstructed spots from everywhere
  std::vector<MovingObject> objects;
  FlightVolume flight_volume;
};

}  // namespace rover
