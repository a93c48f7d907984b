#pragma once

#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "rover/camera/camera.h"
#include "rover/simulation/motion.h"
#include "rover/simulation/scene.h"

namespace rover {

struct RenderOptions {
  int samples = 4;          // rays per pixel, 1 to 256
  double exposure = 0.004;  // s; motion blurs over it
  double readout = 0;       // s from the first row's mid-exposure to the last's; 0: global shutter

  // Throws InputError for values that make no sense.
  void check() const;
};

// One image to take: where the camera is at times around the stamp, which is mid-exposure (with a
// rolling shutter: of the middle row).
struct Shot {
  std::vector<SE3> world_from_camera;  // equally spaced over shot_span(), at least two
  double seconds = 0;                  // of the stamp: moving objects are where they are then
  std::vector<float> lamps;            // weight of each of the kLampGroups
  std::uint64_t seed = 0;              // of the samples' jitter
};

// The time from a shot's first pose to its last, s; centred on the stamp.
double shot_span(const RenderOptions& options);

// A shot of a camera on a moving body, at `seconds` of the motion. Times outside the motion are
// moved to its ends.
Shot take_shot(const Motion& motion, const SE3& body_from_camera, double seconds,
               const RenderOptions& options);

// Ray traces what cameras see of a scene, without noise. A ray per sample through the camera's own
// unprojection (linear within a pixel, which is exact to some 0.001 px), samples spread over
// the pixel and the exposure time; then the blur of a good lens (deviation 0.45 px). Safe to use
// from several threads; each image is rendered by its caller's.
class Renderer {
 public:
  // The scene must outlive the renderer.
  Renderer(const Scene& scene, const std::vector<Camera>& cameras, const RenderOptions& options);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  // The radiance (32-bit float, one channel; 1 is a white surface under the scene's usual light).
  // Black where the camera model has no ray. camera: index into those given.
  cv::Mat render(int camera, const Shot& shot) const;

 private:
  struct View;
  struct Shading;
  void render_row(const View& view, const Shading& shading, int y, float* row) const;

  const Scene& scene_;
  RenderOptions options_;
  struct Rays;
  std::unique_ptr<Rays> rays_;
};

}  // namespace rover
