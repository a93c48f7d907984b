#include "rover/simulation/scene_builder.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "rover/base/thread_pool.h"
#include "rover/simulation/scene_rays.h"

namespace rover {
namespace {

constexpr double kLayer = 0.004;  // m between a plane and what hangs on it

double distance_to_box(const Eigen::Vector3d& p, const Eigen::Vector3d& min,
                       const Eigen::Vector3d& max) {
  return (p - p.cwiseMax(min).cwiseMin(max)).norm();
}

bool overlap(const Eigen::Vector3d& min_a, const Eigen::Vector3d& max_a,
             const Eigen::Vector3d& min_b, const Eigen::Vector3d& max_b) {
  return (min_a.array() < max_b.array()).all() && (min_b.array() < max_a.array()).all();
}

// What a surface becomes where there is hardly any texture.
Surface plain_surface(Surface surface) {
  switch (surface) {
    case Surface::kLamp:
    case Surface::kClouds:
      return surface;
    case Surface::kPoster:
    case Surface::kMetal:
      return Surface::kMetal;
    default:
      return Surface::kPlain;
  }
}

Patch make_patch(const Eigen::Vector3d& corner, const Eigen::Vector3d& right,
                 const Eigen::Vector3d& down) {
  Patch patch;
  patch.origin = corner.cast<float>();
  patch.edge_u = right.cast<float>();
  patch.edge_v = down.cast<float>();
  return patch;
}

}  // namespace

bool KeepFree::allows(const Eigen::Vector3d& box_min, const Eigen::Vector3d& box_max) const {
  if ((min.array() < max.array()).all() && overlap(min, max, box_min, box_max)) return false;
  return std::none_of(path.begin(), path.end(), [&](const Eigen::Vector3d& p) {
    return distance_to_box(p, box_min, box_max) < radius;
  });
}

SceneBuilder::SceneBuilder(std::uint64_t seed, double texel, bool plain)
    : seed_(seed), texel_(texel), plain_(plain), random_(seed) {}

int SceneBuilder::add_texture(cv::Size2d size, Surface surface, double tone, double texel) {
  SurfacePaint paint;
  paint.surface = plain_ ? plain_surface(surface) : surface;
  paint.size = size;
  paint.texel = texel > 0 ? texel : texel_;
  paint.tone = tone;
  paint.seed = hash_seed(seed_, paints_.size(), 1);
  paints_.push_back(paint);
  return static_cast<int>(paints_.size()) - 1;
}

void SceneBuilder::add_patch(const Patch& patch, Surface surface, double tone, double texel) {
  scene_.patches.push_back(patch);
  const cv::Size2d size(patch.edge_u.norm(), patch.edge_v.norm());
  scene_.patches.back().texture = add_texture(size, surface, tone, texel);
}

void SceneBuilder::add_plane(const Plane& plane, Surface surface, double tone, double panel) {
  const int columns = static_cast<int>(std::ceil(plane.width / panel));
  const int rows = static_cast<int>(std::ceil(plane.height / panel));
  const double width = plane.width / columns, height = plane.height / rows;
  for (int i = 0; i < rows * columns; ++i) {
    const Eigen::Vector3d corner = plane.at((i % columns) * width, (i / columns) * height);
    add_patch(make_patch(corner, width * plane.right, height * plane.down), surface, tone);
  }
}

void SceneBuilder::hang(const Plane& plane, double x, double y, cv::Size2d size, Surface surface,
                        double tone, double angle, float emission) {
  const double c = std::cos(angle), s = std::sin(angle);
  const double layer = kLayer + 1e-3 * pick(0, 1);  // overlapping ones do not fight
  Patch patch = make_patch(plane.at(x, y) + layer * plane.front(),
                           size.width * (c * plane.right + s * plane.down),
                           size.height * (c * plane.down - s * plane.right));
  patch.emission = emission;
  patch.casts_shadow = false;
  add_patch(patch, surface, tone);
}

void SceneBuilder::add_box(const SE3& frame, const Eigen::Vector3d& min, const Eigen::Vector3d& max,
                           Surface sides, Surface top, double tone) {
  const Eigen::Matrix3d axes = frame.rotation_matrix();
  const Eigen::Vector3d x = axes.col(0), y = axes.col(1), z = axes.col(2), size = max - min;
  const auto corner = [&](bool right, bool back, bool up) {
    return frame * Eigen::Vector3d(right ? max.x() : min.x(), back ? max.y() : min.y(),
                                   up ? max.z() : min.z());
  };
  const Eigen::Vector3d down = -size.z() * z, wide = size.x() * x, deep = size.y() * y;
  add_patch(make_patch(corner(false, false, true), wide, down), sides, tone);
  add_patch(make_patch(corner(true, false, true), deep, down), sides, tone);
  add_patch(make_patch(corner(true, true, true), -wide, down), sides, tone);
  add_patch(make_patch(corner(false, true, true), -deep, down), sides, tone);
  add_patch(make_patch(corner(false, true, true), wide, -deep), top, tone);
  if (min.z() > 0) add_patch(make_patch(corner(false, false, false), wide, deep), top, tone);
}

void SceneBuilder::add_pillar(const Eigen::Vector3d& foot, double radius, double height, int faces,
                              Surface surface, double tone) {
  const auto corner = [&](int i) {
    const double angle = 2 * std::numbers::pi * i / faces;
    return Eigen::Vector3d(
        foot + Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), height));
  };
  for (int i = 0; i < faces; ++i) {
    add_patch(make_patch(corner(i), corner(i + 1) - corner(i), {0, 0, -height}), surface, tone);
  }
}

void SceneBuilder::add_lamp(const Eigen::Vector3d& position, double intensity, double radius) {
  Lamp lamp;
  lamp.position = position.cast<float>();
  lamp.radius = static_cast<float>(radius);
  lamp.intensity = static_cast<float>(intensity);
  lamp.group = static_cast<int>(scene_.lamps.size()) % kLampGroups;
  scene_.lamps.push_back(lamp);
}

void SceneBuilder::add_moving_object(const Eigen::Vector3d& centre, double circle, double speed) {
  MovingObject object;
  object.half_size = {pick(0.15, 0.3), pick(0.15, 0.3), pick(0.4, 0.9)};
  object.centre = centre + Eigen::Vector3d(0, 0, object.half_size.z());
  object.radius = circle;
  object.angular_speed = (random_.index(2) ? 1 : -1) * speed / circle;
  object.phase = pick(0, 6);
  const Eigen::Vector3d size = 2 * object.half_size;
  const cv::Size2d faces[] = {{size.y(), size.z()}, {size.x(), size.z()}, {size.x(), size.y()}};
  for (int i = 0; i < 6; ++i) {
    object.textures.push_back(add_texture(faces[i / 2], Surface::kPoster, pick(0.3, 0.7), 0));
  }
  scene_.objects.push_back(object);
}

bool SceneBuilder::take(const SE3& frame, const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
  Taken box{Eigen::Vector3d::Constant(1e9), Eigen::Vector3d::Constant(-1e9)};
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner =
        frame * Eigen::Vector3d(i & 1 ? max.x() : min.x(), i & 2 ? max.y() : min.y(),
                                i & 4 ? max.z() : min.z());
    box.min = box.min.cwiseMin(corner);
    box.max = box.max.cwiseMax(corner);
  }
  if (!keep_free_.allows(box.min, box.max)) return false;
  for (const Taken& other : taken_) {
    if (overlap(box.min, box.max, other.min, other.max)) return false;
  }
  taken_.push_back(box);
  return true;
}

Scene SceneBuilder::finish(const std::vector<cv::Mat>& photographs, double light_spacing,
                           double ambient_reach, ThreadPool& pool) {
  std::vector<std::optional<Texture>> textures(paints_.size());
  // Neighbours in the list are of one size: dealt out in turn, threads get equal shares.
  const auto threads = static_cast<std::size_t>(pool.threads());
  pool.parallel_for(threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part) {
      for (std::size_t i = part; i < paints_.size(); i += threads) {
        textures[i].emplace(paint_surface(paints_[i], photographs), paints_[i].texel);
      }
    }
  });
  for (auto& texture : textures) scene_.textures.push_back(std::move(*texture));
  std::vector<Patch> casters;
  for (const Patch& patch : scene_.patches) {
    if (patch.casts_shadow) casters.push_back(patch);
  }
  const SceneRays rays(casters);
  scene_.lighting = Lighting(scene_, rays, light_spacing, ambient_reach, pool);
  return std::move(scene_);
}

}  // namespace rover
