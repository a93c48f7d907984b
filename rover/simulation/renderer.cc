#include "rover/simulation/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "rover/base/error.h"
#include "rover/base/random.h"
#include "rover/simulation/renderer_objects.h"
#include "rover/simulation/renderer_view.h"
#include "rover/simulation/scene_rays.h"

namespace rover {
namespace {

using Packet = SceneRays::Packet;
constexpr int kPacket = SceneRays::kPacket;
constexpr double kLensBlur = 0.45;  // px, deviation

std::vector<Patch> shadow_casters(const Scene& scene) {
  std::vector<Patch> casters;
  for (const Patch& patch : scene.patches) {
    if (patch.casts_shadow) casters.push_back(patch);
  }
  return casters;
}

// What shading needs of a patch, close together in memory.
struct ShadedPatch {
  Eigen::Vector3f normal;
  float emission;
  const Texture* texture;
  Lighting::Grid grid;
  float per_texel;  // 1 / m
};

std::vector<ShadedPatch> shaded_patches(const Scene& scene) {
  std::vector<ShadedPatch> shaded;
  for (std::size_t i = 0; i < scene.patches.size(); ++i) {
    const Patch& patch = scene.patches[i];
    const Texture& texture = scene.textures[patch.texture];
    shaded.push_back(
        {patch.normal(), patch.emission, &texture, scene.lighting.grid(i), 1 / texture.texel()});
  }
  return shaded;
}

// A pixel's samples cover about this share of it each, in one direction.
float sample_footprint(int samples) {
  return std::max(0.3F, 1.6F / std::sqrt(static_cast<float>(samples)));
}

}  // namespace

void RenderOptions::check() const {
  require(samples >= 1 && samples <= 256, "--samples {}: must lie between 1 and 256", samples);
  require(exposure > 0 && exposure <= 0.1, "--exposure {} ms: must lie above 0 and not above 100",
          1000 * exposure);
  require(readout >= 0 && readout <= 0.1, "--rolling-shutter {} ms: must lie between 0 and 100",
          1000 * readout);
}

double shot_span(const RenderOptions& options) { return options.exposure + options.readout; }

Shot take_shot(const Motion& motion, const SE3& body_from_camera, double seconds,
               const RenderOptions& options) {
  constexpr double kSpacing = 5e-4;  // s: poses are interpolated linearly in between
  const double span = shot_span(options);
  const int poses = static_cast<int>(std::ceil(span / kSpacing)) + 1;
  Shot shot;
  shot.seconds = seconds;
  shot.lamps.assign(kLampGroups, 1.0F);
  for (int i = 0; i < poses; ++i) {
    const double at = seconds + span * (static_cast<double>(i) / (poses - 1) - 0.5);
    const double inside = std::clamp(at, motion.begin(), motion.end());
    shot.world_from_camera.push_back(motion.at(inside).world_from_body * body_from_camera);
  }
  return shot;
}

struct Renderer::Rays {
  Rays(const Scene& scene, const std::vector<Camera>& lenses)
      : all(scene.patches),
        casters(shadow_casters(scene)),
        patches(shaded_patches(scene)),
        cameras(lenses.begin(), lenses.end()) {}
  SceneRays all;
  SceneRays casters;  // without what lies flat on other patches
  std::vector<ShadedPatch> patches;
  std::vector<CameraRays> cameras;
};

struct Renderer::View {
  const CameraRays& rays;
  const ShotPoses& poses;
  std::uint64_t seed;
};

// The light of one shot.
struct Renderer::Shading {
  std::vector<float> irradiance;
  LitObjects objects;
  const std::vector<ShadedPatch>& patches;
  float footprint;  // rad

  float radiance(const Packet& rays, int i) const {
    if (const auto seen = objects.hit(rays, i, footprint)) return *seen;
    if (rays.patch[i] < 0) return 0;
    const ShadedPatch& patch = patches[rays.patch[i]];
    const float u = std::clamp(rays.u[i], 0.0F, 1.0F), v = std::clamp(rays.v[i], 0.0F, 1.0F);
    const Eigen::Vector3f direction(rays.dx[i], rays.dy[i], rays.dz[i]);
    const float cosine = std::max(0.05F, std::abs(patch.normal.dot(direction)));
    // Between the footprint's short and long axis: samples fill the long one.
    const float texels = footprint * rays.distance[i] * patch.per_texel / std::sqrt(cosine);
    const float level = texels > 1 ? std::log2(texels) : 0.0F;
    const float light = interpolate(patch.grid, irradiance.data(), u, v) + patch.emission;
    return light * patch.texture->sample(u, v, level);
  }
};

Renderer::Renderer(const Scene& scene, const std::vector<Camera>& cameras,
                   const RenderOptions& options)
    : scene_(scene), options_(options), rays_(std::make_unique<Rays>(scene, cameras)) {
  options.check();
}

Renderer::~Renderer() = default;

void Renderer::render_row(const View& view, const Shading& shading, int y, float* row) const {
  const int width = view.rays.width(), samples = options_.samples;
  const RowPoses poses = view.poses.row(y);
  Packet packet;
  for (int x0 = 0; x0 < width; x0 += kPacket) {
    std::array<float, kPacket> sum{};
    for (int s = 0; s < samples; ++s) {
      for (int i = 0; i < kPacket; ++i) {
        const int x = std::min(x0 + i, width - 1);
        const auto bits = hash_seed(view.seed, static_cast<std::uint64_t>(y) * 65536 + x, s);
        const SampleJitter jitter(bits, s, samples);
        const Eigen::Vector3f ray = view.rays.at(x, y, jitter.dx, jitter.dy);
        poses.place(jitter.time, ray, packet, i);
      }
      rays_->all.trace(packet);
      for (int i = 0; i < kPacket; ++i) sum[i] += shading.radiance(packet, i);
    }
    for (int i = 0; i < kPacket && x0 + i < width; ++i) {
      row[x0 + i] = view.rays.valid(x0 + i, y) ? sum[i] / static_cast<float>(samples) : 0.0F;
    }
  }
}

cv::Mat Renderer::render(int camera, const Shot& shot) const {
  require(shot.world_from_camera.size() >= 2, "a shot needs at least two poses");
  const CameraRays& rays = rays_->cameras[camera];
  const ShotPoses poses(shot.world_from_camera, rays.height(), options_);
  const View view{rays, poses, shot.seed};
  const Shading shading{scene_.lighting.combine(shot.lamps),
                        LitObjects(scene_, rays_->casters, shot), rays_->patches,
                        rays.pixel_angle() * sample_footprint(options_.samples)};
  cv::Mat image(rays.height(), rays.width(), CV_32F);
  for (int y = 0; y < image.rows; ++y) render_row(view, shading, y, image.ptr<float>(y));
  cv::GaussianBlur(image, image, {3, 3}, kLensBlur);
  return image;
}

}  // namespace rover
