#pragma once

#include <memory>

#include "rover/base/random.h"
#include "rover/map/map.h"

namespace rover {

// A small monocular (or, with a baseline, stereo) world for tests: cameras on a line that look
// along z at random points, every point seen by every camera in the feature of the same number.
inline Rig test_rig(double baseline = 0) {
  const Camera camera(CameraModel::kPinhole, 640, 480, {450, 450, 320, 240}, {0, 0, 0, 0});
  Rig rig{{camera}, {SE3()}};
  if (baseline > 0) {
    rig.cameras.push_back(camera);
    rig.body_from_camera.push_back(
        SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(baseline, 0, 0)));
  }
  return rig;
}

inline Frame test_frame(const Rig& rig, const std::vector<Eigen::Vector3d>& points,
                        const SE3& world_from_body, std::int64_t id) {
  auto features = std::make_shared<FeatureSet>();
  features->image_size = {rig.cameras[0].width(), rig.cameras[0].height()};
  features->descriptors = Descriptors::Zero(static_cast<Eigen::Index>(points.size()), 64);
  Frame frame;
  frame.id = {id};
  frame.time = id * kNanosecondsPerSecond / 20;
  frame.world_from_body = world_from_body;
  auto stereo = std::make_shared<std::vector<StereoObservation>>(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d in_body = world_from_body.inverse() * points[i];
    const auto pixel = rig.cameras[0].project(rig.body_from_camera[0].inverse() * in_body);
    features->positions.push_back(pixel->cast<float>());
    features->scores.push_back(1);
    features->sigmas.push_back(0.5f);
    Random random(i);
    auto row = features->descriptors.row(static_cast<Eigen::Index>(i));
    for (auto& value : row) value = static_cast<float>(random.gaussian());
    row.normalize();
    frame.observations.push_back({{}, pixel->cast<float>(), 0.5f, false, false});
    if (rig.size() < 2) continue;
    const auto right = rig.cameras[1].project(rig.body_from_camera[1].inverse() * in_body);
    (*stereo)[i] = {right->cast<float>(), 0.5f, in_body.cast<float>(),
                    static_cast<float>(in_body.norm()), 0.05f};
  }
  frame.features = std::move(features);
  if (rig.size() > 1) frame.stereo = std::move(stereo);
  return frame;
}

inline std::vector<Eigen::Vector3d> test_points(int count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    points.emplace_back(random.uniform(-1, 1), random.uniform(-0.8, 0.8), random.uniform(3, 5));
  }
  return points;
}

// `keyframes` views, 0.1 m apart; landmarks are created by the first and seen by all.
inline Map test_map(int keyframes, int points, double baseline = 0, std::uint64_t seed = 1) {
  auto rig = std::make_shared<const Rig>(test_rig(baseline));
  Map map({0}, rig, std::make_shared<IdSource>());
  const auto world = test_points(points, seed);
  std::vector<LandmarkId> ids;
  for (int k = 0; k < keyframes; ++k) {
    const SE3 pose(so3_exp({0, 0.01 * k, 0}), Eigen::Vector3d(0.1 * k, 0, 0));
    Frame frame = test_frame(*rig, world, pose, k);
    for (std::size_t i = 0; i < ids.size(); ++i) frame.observations[i].landmark = ids[i];
    const KeyframeId id = map.add_keyframe(std::move(frame));
    if (k > 0) continue;
    for (int i = 0; i < points; ++i) {
      ids.push_back(map.add_landmark(world[static_cast<std::size_t>(i)], id, i));
    }
  }
  return map;
}

// Whether both sides of every observation agree, and all ids that are named exist.
inline bool is_consistent(const Map& map) {
  for (const Landmark& landmark : map.landmarks()) {
    if (landmark.observations.empty()) return false;
    for (const auto& [keyframe, feature] : landmark.observations) {
      const Keyframe* observer = map.find(keyframe);
      if (!observer || observer->frame[feature].landmark != landmark.id) return false;
    }
  }
  for (const Keyframe& keyframe : map.keyframes()) {
    if (keyframe.parent.valid() && !map.find(keyframe.parent)) return false;
    for (const KeyframeId child : keyframe.children) {
      if (!map.find(child) || map.at(child).parent != keyframe.id) return false;
    }
    for (const Observation& observation : keyframe.frame.observations) {
      if (!observation.landmark.valid()) continue;
      const Landmark* landmark = map.find(observation.landmark);
      if (!landmark || !landmark->has_observation(keyframe.id)) return false;
    }
  }
  return true;
}

}  // namespace rover
