#include "rover/simulation/scene_lighting.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rover/base/random.h"
#include "rover/base/thread_pool.h"
#include "rover/simulation/scene.h"
#include "rover/simulation/scene_rays.h"

namespace rover {
namespace {

constexpr int kShadowRays = 6;
constexpr int kAmbientRays = 24;
constexpr float kNegligible = 0.004F;  // irradiance not worth shadow rays
constexpr float kUpwards = 0.05F;      // share of a lamp's light that goes sideways and up
constexpr float kLift = 0.004F;        // m above the surface where rays begin

Eigen::Vector3f random_in_ball(Random& random) {
  for (;;) {
    const Eigen::Vector3d p(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    if (p.squaredNorm() <= 1) return p.cast<float>();
  }
}

// Distributed by the cosine to the normal (Malley's method, with a ball on the surface).
Eigen::Vector3f random_cosine(const Eigen::Vector3f& normal, Random& random) {
  const Eigen::Vector3f direction = normal + random_in_ball(random).normalized();
  return direction.norm() > 1e-3F ? Eigen::Vector3f(direction.normalized()) : normal;
}

float lamp_irradiance(const Lamp& lamp, const SceneRays& rays, const Eigen::Vector3f& point,
                      const Eigen::Vector3f& normal, Random& random) {
  const Eigen::Vector3f to_lamp = lamp.position - point;
  const float distance2 = to_lamp.squaredNorm() + lamp.radius * lamp.radius;
  const float cosine = normal.dot(to_lamp) / std::sqrt(distance2);
  const float below = std::max(0.0F, to_lamp.z() / std::sqrt(distance2));
  const float unshaded = lamp.intensity * (kUpwards + (1 - kUpwards) * below) * cosine / distance2;
  if (unshaded < kNegligible) return 0;
  int lit = 0;
  for (int i = 0; i < kShadowRays; ++i) {
    const Eigen::Vector3f target = lamp.position + lamp.radius * random_in_ball(random);
    if (!rays.blocked(point, target - point, 0.999F)) ++lit;
  }
  return unshaded * static_cast<float>(lit) / kShadowRays;
}

float openness(const SceneRays& rays, const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
               double reach, Random& random) {
  int open = 0;
  for (int i = 0; i < kAmbientRays; ++i) {
    const Eigen::Vector3f direction = static_cast<float>(reach) * random_cosine(normal, random);
    if (!rays.blocked(point, direction, 1)) ++open;
  }
  // Walls that are near give light back.
  constexpr float kFloor = 0.35F;
  return kFloor + (1 - kFloor) * static_cast<float>(open) / kAmbientRays;
}

int nodes_along(float length, double spacing) {
  return std::clamp(static_cast<int>(std::ceil(length / spacing)) + 1, 2, 2000);
}

// Evens out what few random rays leave uneven.
void smooth(const Lighting::Grid& grid, std::vector<float>& values) {
  const std::vector<float> before(values.begin() + grid.offset,
                                  values.begin() + grid.offset + grid.width * grid.height);
  const auto at = [&](int x, int y) {
    return before[std::clamp(y, 0, grid.height - 1) * grid.width +
                  std::clamp(x, 0, grid.width - 1)];
  };
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      const float corners =
          at(x - 1, y - 1) + at(x + 1, y - 1) + at(x - 1, y + 1) + at(x + 1, y + 1);
      const float sides = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1);
      values[grid.offset + y * grid.width + x] = (4 * at(x, y) + 2 * sides + corners) / 16;
    }
  }
}

}  // namespace

std::vector<float> irradiance_by_group(const Scene& scene, const SceneRays& rays,
                                       const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
                                       std::uint64_t seed) {
  Random random(seed);
  std::vector<float> groups(kLampGroups, 0.0F);
  for (const Lamp& lamp : scene.lamps) {
    groups[lamp.group] += lamp_irradiance(lamp, rays, point + kLift * normal, normal, random);
  }
  return groups;
}

Lighting::Lighting(const Scene& scene, const SceneRays& rays, double spacing, double ambient_reach,
                   ThreadPool& pool) {
  std::size_t size = 0;
  for (const Patch& patch : scene.patches) {
    const Grid grid{nodes_along(patch.edge_u.norm(), spacing),
                    nodes_along(patch.edge_v.norm(), spacing), size};
    size += static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height);
    grids_.push_back(grid);
  }
  layers_.assign(kLampGroups + 1, std::vector<float>(size, 0.0F));
  pool.parallel_for(grids_.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) trace_patch(scene, rays, i, ambient_reach);
  });
}

void Lighting::trace_patch(const Scene& scene, const SceneRays& rays, std::size_t index,
                           double reach) {
  const Patch& patch = scene.patches[index];
  const Grid& grid = grids_[index];
  const Eigen::Vector3f normal = patch.normal();
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      // A little inside the edges, where another surface may begin.
      const float u = 0.002F + 0.996F * static_cast<float>(x) / static_cast<float>(grid.width - 1);
      const float v = 0.002F + 0.996F * static_cast<float>(y) / static_cast<float>(grid.height - 1);
      const Eigen::Vector3f point = patch.origin + u * patch.edge_u + v * patch.edge_v;
      const std::size_t node = grid.offset + static_cast<std::size_t>(y * grid.width + x);
      const auto groups = irradiance_by_group(scene, rays, point, normal, hash_seed(index, node));
      for (int g = 0; g < kLampGroups; ++g) layers_[g][node] = groups[g];
      Random random(hash_seed(index, node, 1));
      layers_[kLampGroups][node] =
          scene.ambient * openness(rays, point + kLift * normal, normal, reach, random);
    }
  }
  for (std::vector<float>& layer : layers_) smooth(grid, layer);
}

std::vector<float> Lighting::combine(const std::vector<float>& group_weights) const {
  if (layers_.empty()) return {};
  float mean = 0;
  for (const float weight : group_weights) mean += weight / kLampGroups;
  std::vector<float> sum(layers_[0].size(), 0.0F);
  for (int g = 0; g <= kLampGroups; ++g) {
    const float weight = g < kLampGroups ? group_weights[g] : mean;
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += weight * layers_[g][i];
  }
  return sum;
}

}  // namespace rover
