#include "rover/map/appearance.h"

#include <algorithm>
#include <cmath>

namespace rover {
namespace {

// Beyond these the patch is too small, too large or too slanted in the new image to be compared.
constexpr float kMinScale = 0.4f;
constexpr float kMaxScale = 2.5f;

}  // namespace

std::shared_ptr<const Appearance> make_appearance(const Camera& camera, const Frame& frame,
                                                  int feature) {
  const Eigen::Vector2f& pixel = frame[feature].pixel;
  const Eigen::Vector2d center = pixel.cast<double>();
  const auto ray = camera.unproject(center);
  const auto right = camera.unproject(center + Eigen::Vector2d::UnitX());
  const auto down = camera.unproject(center + Eigen::Vector2d::UnitY());
  if (!ray || !right || !down) return nullptr;
  auto appearance = std::make_shared<Appearance>();
  appearance->descriptor = frame.features->descriptors.row(feature).transpose();
  appearance->ray = *ray;
  appearance->ray_right = *right;
  appearance->ray_down = *down;
  if (frame.image.empty()) return appearance;
  if (const auto patch = cut_patch(frame.image, pixel)) {
    appearance->has_patch = true;
    appearance->patch = *patch;
  }
  return appearance;
}

std::optional<Eigen::Matrix2f> patch_warp(const Landmark& landmark, const Camera& camera,
                                          const SE3& camera_from_world) {
  const Appearance& look = *landmark.appearance;
  const SE3& world_from_reference = landmark.world_from_reference;
  const double depth = (landmark.position - world_from_reference.translation).norm();
  const SE3 camera_from_reference = camera_from_world * world_from_reference;
  // Points of the plane through the landmark that is perpendicular to its reference ray.
  const auto on_plane = [&](const Eigen::Vector3d& ray) -> Eigen::Vector3d {
    return ray * (depth / ray.dot(look.ray));
  };
  const auto center = camera.project(camera_from_reference * on_plane(look.ray));
  const auto right = camera.project(camera_from_reference * on_plane(look.ray_right));
  const auto down = camera.project(camera_from_reference * on_plane(look.ray_down));
  if (!center || !right || !down) return std::nullopt;
  Eigen::Matrix2f warp;
  warp.col(0) = (*right - *center).cast<float>();
  warp.col(1) = (*down - *center).cast<float>();
  const float area = warp.determinant();
  const float length = warp.norm() / std::sqrt(2.0f);
  if (area < kMinScale * kMinScale || length > kMaxScale) return std::nullopt;
  return warp;
}

bool refine_observation(const Landmark& landmark, const Camera& camera,
                        const SE3& camera_from_world, const cv::Mat& image,
                        const PatchRefinementOptions& options, Observation& observation) {
  if (!landmark.appearance->has_patch || image.empty()) return false;
  const auto warp = patch_warp(landmark, camera, camera_from_world);
  if (!warp) return false;
  const auto refined =
      refine_position(landmark.appearance->patch, image, observation.pixel, *warp, options);
  if (!refined) return false;
  observation.pixel = refined->position;
  observation.sigma = refined->sigma;
  observation.refined = true;
  return true;
}

}  // namespace rover
