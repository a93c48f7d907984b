#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace rover {

class SceneRays;
class ThreadPool;
struct Patch;
struct Scene;

// A small round lamp. At distance d straight below it the irradiance is `intensity` / d^2, above it
// hardly any: as under a shade.
struct Lamp {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  float radius = 0.15F;  // m; makes soft shadows
  float intensity = 1;
  int group = 0;  // lamps of one group brighten and dim together
};

inline constexpr int kLampGroups = 4;

// The irradiance of all patches, sampled on a coarse grid over each and kept apart by groups of
// lamps, so that lamps can be dimmed without tracing shadows again.
class Lighting {
 public:
  struct Grid {
    int width = 0, height = 0;
    std::size_t offset = 0;  // into the values of combine()
  };

  Lighting() = default;
  // Traces soft shadows and the openness to ambient light for each node. `spacing`: between nodes,
  // m. Deterministic, whatever the number of threads.
  Lighting(const Scene& scene, const SceneRays& rays, double spacing, double ambient_reach,
           ThreadPool& pool);

  const Grid& grid(std::size_t patch) const { return grids_[patch]; }
  // Irradiance at all nodes with the groups weighted like this; ambient light is weighted by their
  // mean.
  std::vector<float> combine(const std::vector<float>& group_weights) const;

 private:
  void trace_patch(const Scene& scene, const SceneRays& rays, std::size_t patch, double reach);

  std::vector<Grid> grids_;
  std::vector<std::vector<float>> layers_;  // one per group, then ambient
};

// Bilinear between the nodes of a grid; u and v in [0, 1].
inline float interpolate(const Lighting::Grid& grid, const float* values, float u, float v) {
  const float x = u * static_cast<float>(grid.width - 1);
  const float y = v * static_cast<float>(grid.height - 1);
  const int x0 = x < static_cast<float>(grid.width - 1) ? static_cast<int>(x) : grid.width - 2;
  const int y0 = y < static_cast<float>(grid.height - 1) ? static_cast<int>(y) : grid.height - 2;
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const float* p = values + grid.offset +
                   static_cast<std::size_t>(y0) * static_cast<std::size_t>(grid.width) +
                   static_cast<std::size_t>(x0);
  const float top = p[0] + fx * (p[1] - p[0]);
  const float bottom = p[grid.width] + fx * (p[grid.width + 1] - p[grid.width]);
  return top + fy * (bottom - top);
}

// Irradiance that one spot with a normal gets from the lamps of each group.
std::vector<float> irradiance_by_group(const Scene& scene, const SceneRays& rays,
                                       const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
                                       std::uint64_t seed);

}  // namespace rover
