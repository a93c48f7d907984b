#pragma once

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

#include "rover/base/error.h"
#include "rover/base/thread_pool.h"
#include "rover/camera/camera.h"
#include "rover/datasets/trajectory.h"
#include "rover/simulation/scene_factory.h"
#include "rover/simulation/scene_rays.h"

namespace rover {

// A stereo sequence of `rover simulate` (without --along), and what its scene was made from.
struct SimulatedSequence {
  std::string path, scene = "room", texture = "rich";
  std::uint64_t scene_seed = 1;
  int threads = 2;

  void add_options(CLI::App& program) {
    program.add_option("sequence", path, "a folder of rover simulate")->required();
    program.add_option("--scene", scene, "as it was given to rover simulate");
    program.add_option("--texture", texture, "likewise");
    program.add_option("--scene-seed", scene_seed, "likewise");
    program.add_option("--threads", threads, "default 2");
  }
  Scene make() const {
    SceneOptions options;
    options.kind = parse_scene_kind(scene);
    options.seed = scene_seed;
    options.low_texture = parse_low_texture(texture);
    ThreadPool pool(threads);
    return make_scene(options, pool);
  }
};

// The last image of a sequence may lie beyond the last pose of its ground truth.
inline bool ends_before(const Trajectory& poses, Timestamp time) {
  return !poses.empty() && poses.back().time < time;
}

// What the cameras of a simulated sequence really see. Keeps references.
class SceneTruth {
 public:
  SceneTruth(const Scene& scene, const Rig& rig, const Trajectory& poses)
      : rays_(scene.patches),
        rig_(rig),
        poses_(poses),
        right_from_left_(rig.body_from_camera[1].inverse() * rig.body_from_camera[0]) {}

  SE3 world_from_left(Timestamp time) const {
    const auto at = std::ranges::lower_bound(poses_, time, {}, &StampedPose::time);
    require(at != poses_.end() && at->time == time,
            "the ground truth has no pose at {}; use a sequence of rover simulate", time);
    return at->pose * rig_.body_from_camera[0];
  }

  // The point that the left camera sees at a pixel, in its frame, m.
  std::optional<Eigen::Vector3d> point_at(const Eigen::Vector2d& pixel,
                                          const SE3& world_from_left) const {
    const auto ray = rig_.cameras[0].unproject(pixel);
    if (!ray) return std::nullopt;
    const auto distance = trace(world_from_left.translation, world_from_left.rotation * *ray);
    if (!distance) return std::nullopt;
    return *distance * *ray;
  }

  // How far a right position is towards the near end of the epipolar line, px.
  std::optional<double> disparity_error(const Eigen::Vector2d& left, const Eigen::Vector2d& right,
                                        const SE3& world_from_left) const {
    const auto point = point_at(left, world_from_left);
    if (!point) return std::nullopt;
    const auto seen = rig_.cameras[1].project(right_from_left_ * *point);
    const auto at_infinity = rig_.cameras[1].project(right_from_left_.rotation * *point);
    if (!seen || !at_infinity) return std::nullopt;
    return (right - *seen).dot((*seen - *at_infinity).normalized());
  }

 private:
  // The distance along a ray to what it hits, in multiples of the direction.
  std::optional<double> trace(const Eigen::Vector3d& origin,
                              const Eigen::Vector3d& direction) const {
    SceneRays::Packet packet;
    packet.ox.fill(static_cast<float>(origin.x()));
    packet.oy.fill(static_cast<float>(origin.y()));
    packet.oz.fill(static_cast<float>(origin.z()));
    packet.dx.fill(static_cast<float>(direction.x()));
    packet.dy.fill(static_cast<float>(direction.y()));
    packet.dz.fill(static_cast<float>(direction.z()));
    rays_.trace(packet);
    if (packet.patch[0] < 0) return std::nullopt;
    return packet.distance[0];
  }

  SceneRays rays_;
  const Rig& rig_;
  const Trajectory& poses_;
  SE3 right_from_left_;
};

}  // namespace rover
