#pragma once

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>

namespace rover {

struct Patch;

// Rays against the patches of a scene, by Embree. Safe to use from several threads.
class SceneRays {
 public:
  static constexpr int kPacket = 8;

  // Rays that begin near each other and point about the same way are traced together. Directions
  // need no unit length: distances are in multiples of theirs.
  struct alignas(32) Packet {
    std::array<float, kPacket> ox, oy, oz;  // origins
    std::array<float, kPacket> dx, dy, dz;  // directions
    std::array<float, kPacket> distance;    // of the hit
    std::array<float, kPacket> u, v;        // where in the patch
    std::array<int, kPacket> patch;         // -1: nothing hit
  };

  explicit SceneRays(const std::vector<Patch>& patches);
  ~SceneRays();
  SceneRays(const SceneRays&) = delete;
  SceneRays& operator=(const SceneRays&) = delete;

  // Fills the hits.
  void trace(Packet& packet) const;

  // Whether anything lies between origin and origin + end * direction.
  bool blocked(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float end) const;

 private:
  struct Embree;
  std::unique_ptr<Embree> embree_;
};

}  // namespace rover
