#include "rover/simulation/scene_rays.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <limits>
#include <stdexcept>

#include "rover/simulation/scene.h"

namespace rover {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Embree 3 and 4 differ in how they are told that rays are coherent.
void intersect(RTCScene scene, const int* valid, RTCRayHit8& rays) {
#if RTC_VERSION_MAJOR >= 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &rays, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &context, &rays);
#endif
}

void occlude(RTCScene scene, RTCRay& ray) {
#if RTC_VERSION_MAJOR >= 4
  rtcOccluded1(scene, &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
#endif
}

void add_quads(RTCDevice device, RTCScene scene, const std::vector<Patch>& patches) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_QUAD);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               4 * patches.size()));
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(unsigned), patches.size()));
  if (!vertices || !indices) throw std::runtime_error("Embree cannot hold the scene");
  unsigned next = 0;
  for (const Patch& p : patches) {
    const Eigen::Vector3f corners[] = {p.origin, p.origin + p.edge_u,
                                       p.origin + p.edge_u + p.edge_v, p.origin + p.edge_v};
    for (const Eigen::Vector3f& corner : corners) {
      for (int axis = 0; axis < 3; ++axis) *vertices++ = corner[axis];
      *indices++ = next++;
    }
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
}

}  // namespace

struct SceneRays::Embree {
  Embree() : device(rtcNewDevice("threads=1")), scene(device ? rtcNewScene(device) : nullptr) {
    if (!device) throw std::runtime_error("Embree does not start");
  }
  ~Embree() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;

  RTCDevice device;
  RTCScene scene;
};

SceneRays::SceneRays(const std::vector<Patch>& patches) : embree_(std::make_unique<Embree>()) {
  // The same picture whatever the order in which triangles are visited.
  rtcSetSceneFlags(embree_->scene, RTC_SCENE_FLAG_ROBUST);
  add_quads(embree_->device, embree_->scene, patches);
  rtcCommitScene(embree_->scene);
}

SceneRays::~SceneRays() = default;

void SceneRays::trace(Packet& packet) const {
  RTCRayHit8 rays;
  alignas(32) int valid[kPacket];
  for (int i = 0; i < kPacket; ++i) {
    valid[i] = -1;
    rays.ray.org_x[i] = packet.ox[i];
    rays.ray.org_y[i] = packet.oy[i];
    rays.ray.org_z[i] = packet.oz[i];
    rays.ray.dir_x[i] = packet.dx[i];
    rays.ray.dir_y[i] = packet.dy[i];
    rays.ray.dir_z[i] = packet.dz[i];
    rays.ray.tnear[i] = 0;
    rays.ray.tfar[i] = kInfinity;
    rays.ray.time[i] = 0;
    rays.ray.mask[i] = ~0U;
    rays.ray.flags[i] = 0;
    rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    rays.hit.primID[i] = RTC_INVALID_GEOMETRY_ID;
  }
  intersect(embree_->scene, valid, rays);
  for (int i = 0; i < kPacket; ++i) {
    const bool hit = rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
    packet.patch[i] = hit ? static_cast<int>(rays.hit.primID[i]) : -1;
    packet.distance[i] = rays.ray.tfar[i];
    packet.u[i] = rays.hit.u[i];
    packet.v[i] = rays.hit.v[i];
  }
}

bool SceneRays::blocked(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                        float end) const {
  RTCRay ray{};
  ray.org_x = origin.x();
  ray.org_y = origin.y();
  ray.org_z = origin.z();
  ray.dir_x = direction.x();
  ray.dir_y = direction.y();
  ray.dir_z = direction.z();
  ray.tfar = end;
  ray.mask = ~0U;
  occlude(embree_->scene, ray);
  return ray.tfar < 0;  // Embree's mark
}

}  // namespace rover
