#include "rover/map/appearance.h"

#include <algorithm>
#include <cmath>

namespace rover {
namespace {

// Beyond these the patch is too small, too large or too slanted in the new image to be compared.
constexpr float kMinScale = 0.4f;
constexpr float kMaxScale = 2.5f;

// px. Detections err by up to 2 px where the view changes. Of a feature farther than this from its
// landmark's projection the pose or the match may be wrong: alignment starts at the feature.
constexpr float kMaxDetectionError = 3;

bool is_comparable(const Eigen::Matrix2f& warp) {
  return warp.determinant() >= kMinScale * kMinScale && warp.norm() / std::sqrt(2.0f) <= kMaxScale;
}

// The normal that a slant tells, reference camera's frame; its product with the central ray is 1.
Eigen::Vector3d normal_of(const Appearance& look, const Eigen::Vector2f& slant) {
  const Eigen::Vector3d down = look.ray.cross(look.ray_right).normalized();
  const Eigen::Vector3d right = down.cross(look.ray);
  return look.ray + static_cast<double>(slant.x()) * right + static_cast<double>(slant.y()) * down;
}

// Columns: where the points one pixel to the right of a patch's centre and below it are seen, from
// where the centre is, if the patch lies in the plane with this slant. Nothing if one cannot be
// seen.
std::optional<Eigen::Matrix2f> plane_warp(const Landmark& landmark, const Camera& camera,
                                          const SE3& camera_from_world,
                                          const Eigen::Vector2f& slant) {
  const Appearance& look = *landmark.appearance;
  const SE3 camera_from_reference = camera_from_world * landmark.world_from_reference;
  const Eigen::Vector3d normal = normal_of(look, slant);
  const double depth = (landmark.position - landmark.world_from_reference.translation).norm();
  const auto see = [&](const Eigen::Vector3d& ray) {
    return camera.project(camera_from_reference * (ray * (depth / ray.dot(normal))).eval());
  };
  const auto center = see(look.ray), right = see(look.ray_right), down = see(look.ray_down);
  if (!center || !right || !down) return std::nullopt;
  Eigen::Matrix2f warp;
  warp.col(0) = (*right - *center).cast<float>();
  warp.col(1) = (*down - *center).cast<float>();
  return warp;
}

// Where a landmark is expected in an image of a camera, if the feature joined to it lies there.
std::optional<Eigen::Vector2f> expected_place(const Landmark& landmark, const Camera& camera,
                                              const SE3& camera_from_world,
                                              const Observation& observation) {
  const auto seen = camera.project(camera_from_world * landmark.position);
  if (!seen) return std::nullopt;
  const Eigen::Vector2f place = seen->cast<float>();
  if ((place - observation.pixel).norm() > kMaxDetectionError) return std::nullopt;
  return place;
}

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

std::optional<SlantedWarp> slanted_warp(const Landmark& landmark, const Camera& camera,
                                        const SE3& camera_from_world) {
  const auto lean = [&](float right, float down) {
    return plane_warp(landmark, camera, camera_from_world, {right, down});
  };
  const auto facing = lean(0, 0), leans_right = lean(1, 0), leans_down = lean(0, 1);
  if (!facing || !leans_right || !leans_down) return std::nullopt;
  return SlantedWarp{*facing, {*leans_right - *facing, *leans_down - *facing}};
}

bool refine_observation(const Landmark& landmark, const Camera& camera,
                        const SE3& camera_from_world, const cv::Mat& image,
                        const PatchRefinementOptions& options, Observation& observation) {
  if (!landmark.appearance->has_patch || image.empty()) return false;
  const auto warp = plane_warp(landmark, camera, camera_from_world, landmark.slant.mean);
  if (!warp || !is_comparable(*warp)) return false;
  const auto align = [&](const Eigen::Vector2f& start) {
    return refine_position(landmark.appearance->patch, image, start, *warp, options);
  };
  std::optional<RefinedPosition> refined;
  if (const auto start = expected_place(landmark, camera, camera_from_world, observation)) {
    refined = align(*start);
  }
  if (!refined) refined = align(observation.pixel);
  if (!refined) return false;
  observation.pixel = refined->position;
  observation.sigma = refined->sigma;
  observation.refined = true;
  return true;
}

std::optional<Slant> learn_slant(const Landmark& landmark, const Camera& camera,
                                 const SE3& camera_from_world, const cv::Mat& image,
                                 const SlantOptions& options, const Observation& observation) {
  if (!landmark.appearance->has_patch || image.empty()) return std::nullopt;
  const auto place = observation.refined
                         ? observation.pixel
                         : expected_place(landmark, camera, camera_from_world, observation);
  if (!place) return std::nullopt;
  const auto warp = slanted_warp(landmark, camera, camera_from_world);
  if (!warp || !is_comparable(warp->at(landmark.slant.mean))) return std::nullopt;
  const auto learned =
      update_slant(landmark.appearance->patch, image, *place, *warp, landmark.slant, options);
  if (!learned || !is_comparable(warp->at(learned->mean))) return std::nullopt;
  return learned;
}

}  // namespace rover
