#include "rover/map/visibility.h"

#include <cmath>
#include <numbers>

namespace rover {

std::optional<Eigen::Vector2d> predict_pixel(const Landmark& landmark, const Camera& camera,
                                             const SE3& world_from_camera, double max_view_angle) {
  const Eigen::Vector3d ray = landmark.position - world_from_camera.translation;
  const Eigen::Vector3d reference = landmark.position - landmark.world_from_reference.translation;
  const double cosine = ray.dot(reference) / (ray.norm() * reference.norm());
  if (!(cosine > std::cos(max_view_angle * std::numbers::pi / 180))) return std::nullopt;
  const auto pixel = camera.project(world_from_camera.rotation.conjugate() * ray);
  if (!pixel || !camera.contains(*pixel)) return std::nullopt;
  return pixel;
}

}  // namespace rover
