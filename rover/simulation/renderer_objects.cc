#include "rover/simulation/renderer_objects.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rover/base/random.h"

namespace rover {
namespace {

using Eigen::Vector3f;

Vector3f face_normal(int face) {
  Vector3f normal = Vector3f::Zero();
  normal[face / 2] = face % 2 ? 1.0F : -1.0F;
  return normal;
}

float face_irradiance(const Scene& scene, const SceneRays& casters, const Shot& shot,
                      const Vector3f& centre, const Vector3f& normal) {
  const auto groups = irradiance_by_group(scene, casters, centre, normal, hash_seed(shot.seed, 2));
  float sum = 0;
  for (int g = 0; g < kLampGroups; ++g) sum += shot.lamps[g] * (groups[g] + scene.ambient / 4);
  return sum;
}

}  // namespace

LitObjects::LitObjects(const Scene& scene, const SceneRays& casters, const Shot& shot) {
  for (const MovingObject& moving : scene.objects) {
    const SE3 pose = moving.world_from_object(shot.seconds);
    Object object;
    object.object_from_world = pose.rotation_matrix().transpose().cast<float>();
    object.position = pose.translation.cast<float>();
    object.half_size = moving.half_size.cast<float>();
    for (int face = 0; face < 6; ++face) {
      const Vector3f normal = face_normal(face);
      const Eigen::Matrix3f rotation = object.object_from_world.transpose();
      const Vector3f centre = object.position + rotation * normal.cwiseProduct(object.half_size);
      object.irradiance[face] = face_irradiance(scene, casters, shot, centre, rotation * normal);
      object.textures[face] = &scene.textures[moving.textures[face]];
    }
    objects_.push_back(object);
  }
}

// The slab test.
std::optional<LitObjects::Entry> LitObjects::enter(const Object& object, const Vector3f& origin,
                                                   const Vector3f& direction) {
  const Vector3f from = object.object_from_world * (origin - object.position);
  const Vector3f along = object.object_from_world * direction;
  float near = 0, far = std::numeric_limits<float>::infinity();
  int face = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const float inverse = 1 / along[axis];
    const float half = std::copysign(object.half_size[axis], along[axis]);
    const float in = (-half - from[axis]) * inverse, out = (half - from[axis]) * inverse;
    if (in > near) near = in, face = 2 * axis + (along[axis] < 0 ? 1 : 0);
    far = std::min(far, out);
  }
  if (face < 0 || !(near < far)) return std::nullopt;
  return Entry{near, face, (from + near * along).cwiseQuotient(object.half_size)};
}

float LitObjects::radiance(const Object& object, const Entry& entry, float footprint) {
  const int axis = entry.face / 2;
  const float across = entry.point[axis == 0 ? 1 : 0], up = entry.point[axis == 2 ? 1 : 2];
  const Texture& texture = *object.textures[entry.face];
  const float texels = std::max(1.0F, footprint * entry.distance / texture.texel());
  const float u = std::clamp(0.5F + 0.5F * across, 0.0F, 1.0F);
  const float v = std::clamp(0.5F - 0.5F * up, 0.0F, 1.0F);
  return object.irradiance[entry.face] * texture.sample(u, v, std::log2(texels));
}

std::optional<float> LitObjects::hit(const SceneRays::Packet& rays, int i, float footprint) const {
  const Vector3f origin(rays.ox[i], rays.oy[i], rays.oz[i]);
  const Vector3f direction(rays.dx[i], rays.dy[i], rays.dz[i]);
  float nearest = rays.patch[i] < 0 ? std::numeric_limits<float>::infinity() : rays.distance[i];
  std::optional<float> seen;
  for (const Object& object : objects_) {
    const auto entry = enter(object, origin, direction);
    if (!entry || entry->distance >= nearest) continue;
    nearest = entry->distance;
    seen = radiance(object, *entry, footprint);
  }
  return seen;
}

}  // namespace rover
