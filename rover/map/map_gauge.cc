// How a map moves as a whole: its gauge, its unit of length, and where the body is.

#include <vector>

#include "rover/map/map.h"

namespace rover {
namespace {

bool same(const SE3& a, const SE3& b) {
  return a.rotation.coeffs() == b.rotation.coeffs() && a.translation == b.translation;
}

// Keyframes that were culled follow a change of the map's units.
void rescale_retired(const Map& map, const MapUnits& then,
                     CowTable<KeyframeId, RetiredKeyframe>& table) {
  std::vector<KeyframeId> retired;
  for (const RetiredKeyframe& keyframe : table) retired.push_back(keyframe.id);
  for (const KeyframeId id : retired) {
    RetiredKeyframe& keyframe = table.edit(id);
    keyframe.parent_from_body = map.rescale_relative(keyframe.parent_from_body, then);
  }
}

}  // namespace

// Distances between cameras scale, those between a camera and the body do not.
SE3 Map::rescale_relative(const SE3& a_from_b, const MapUnits& then) const {
  const MapUnits now = units();
  const double factor = now.scale / then.scale;
  if (factor == 1 && same(now.body_from_camera, then.body_from_camera)) return a_from_b;
  SE3 cameras = then.body_from_camera.inverse() * a_from_b * then.body_from_camera;
  cameras.translation *= factor;
  return now.body_from_camera * cameras * now.body_from_camera.inverse();
}

void Map::move_rig(const SE3& body_from_camera) {
  const MapUnits then = units();
  const SE3 new_from_old = body_from_camera * then.body_from_camera.inverse();
  if (!calibration_.given) calibration_.given = then.body_from_camera;
  auto rig = std::make_shared<Rig>(*rig_);
  for (SE3& camera : rig->body_from_camera) camera = new_from_old * camera;
  rig->body_from_camera[0] = body_from_camera;
  rig_ = std::move(rig);
  std::vector<KeyframeId> keyframes;
  for (const Keyframe& keyframe : keyframes_) keyframes.push_back(keyframe.id);
  for (const KeyframeId id : keyframes) move_body(id, new_from_old);
  rescale_retired(*this, then, retired_);
  ++epoch_;
}

// Its new origin goes round the old one as the body turns.
void Map::move_body(KeyframeId id, const SE3& new_from_old) {
  Keyframe& keyframe = keyframes_.edit(id);
  const SE3 old_from_new = new_from_old.inverse();
  if (keyframe.motion) {
    const Eigen::Vector3d rate =
        keyframe.motion->samples().back().angular_velocity - keyframe.bias.gyroscope;
    keyframe.velocity += keyframe.world_from_body().rotation * rate.cross(old_from_new.translation);
  }
  keyframe.frame.world_from_body = keyframe.world_from_body() * old_from_new;
  keyframe.covariance.reset();
}

void Map::move(KeyframeId id, const Sim3& new_world_from_world) {
  const SE3& body_from_camera = rig_->body_from_camera[0];
  Keyframe& keyframe = keyframes_.edit(id);
  keyframe.frame.world_from_body =
      move_pose(new_world_from_world, keyframe.world_from_body() * body_from_camera) *
      body_from_camera.inverse();
  keyframe.velocity =
      new_world_from_world.scale * (new_world_from_world.rotation * keyframe.velocity);
  if (!keyframe.covariance || new_world_from_world.scale == 1) return;
  StateCovariance known = *keyframe.covariance;  // its mean turns with the pose: see prior_of
  known.mean.velocity *= new_world_from_world.scale;
  keyframe.covariance = std::make_shared<const StateCovariance>(known);
}

void Map::move(LandmarkId id, const Sim3& new_world_from_world) {
  Landmark& landmark = landmarks_.edit(id);
  landmark.position = new_world_from_world * landmark.position;
  landmark.world_from_reference = move_pose(new_world_from_world, landmark.world_from_reference);
}

void Map::transform(const Sim3& new_world_from_world) {
  std::vector<KeyframeId> keyframes;
  for (const Keyframe& keyframe : keyframes_) keyframes.push_back(keyframe.id);
  for (const KeyframeId id : keyframes) {
    move(id, new_world_from_world);
    set_covariance(id, nullptr);
  }
  std::vector<LandmarkId> landmarks;
  for (const Landmark& landmark : landmarks_) landmarks.push_back(landmark.id);
  for (const LandmarkId id : landmarks) move(id, new_world_from_world);
  rescale(new_world_from_world.scale);
  ++epoch_;
}

void Map::rescale(double factor) {
  const MapUnits then = units();
  scale_ *= factor;
  rescale_retired(*this, then, retired_);
}

}  // namespace rover
