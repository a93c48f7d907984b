#pragma once

#include <memory>

#include "rover/imu/clock_shift.h"
#include "rover/map/map.h"
#include "rover/optimization/simulated_flight.h"

namespace rover {

// A map made of a simulated flight, keyframe by keyframe, for tests: true poses and points moved by
// `map_from_world`, the flight's noisy observations and inertial data.
class SimulatedMap {
 public:
  explicit SimulatedMap(const SimulatedFlight& flight, const Sim3& map_from_world = {})
      : flight_(flight),
        scale_(map_from_world.scale),
        map_from_world_(map_from_world),
        rig_(std::make_shared<const Rig>(flight.truth.bundle.rig)),
        landmarks_(flight.truth.bundle.points.size()) {}

  // The map is begun with extrinsics that are wrong.
  void believe(const SE3& body_from_camera) {
    Map map = blank();
    map.move_rig(body_from_camera);
    rig_ = map.shared_rig();
  }

  Map blank() const { return Map({0}, rig_, std::make_shared<IdSource>()); }

  // After an adjustment: what comes next is where the newest keyframe sees it.
  void follow(const Map& map) {
    const Keyframe& newest = map.at(map.newest_keyframe());
    rig_ = map.shared_rig();
    const SE3& body_from_camera = rig_->body_from_camera[0];
    const auto index = static_cast<std::size_t>(newest.frame.id.value);
    const SE3 truth = true_camera(index);
    map_from_world_ = Sim3(newest.world_from_body() * body_from_camera, scale_ * map.scale()) *
                      Sim3(truth).inverse();
  }

  // Where the map would have a keyframe.
  SE3 pose(int index) const {
    const SE3 camera = true_camera(static_cast<std::size_t>(index));
    return move_pose(map_from_world_, camera) * rig_->body_from_camera[0].inverse();
  }

  // Adds the next keyframe and the landmarks that it sees first.
  KeyframeId add(Map& map, int index) {
    Frame frame = make_frame(index, pose(index));
    for (int f = 0; f < frame.size(); ++f) frame[f].landmark = landmarks_[points_[f]];
    const KeyframeId id = map.add_keyframe(std::move(frame));
    for (std::size_t f = 0; f < points_.size(); ++f) {
      LandmarkId& landmark = landmarks_[points_[f]];
      if (landmark.valid()) continue;
      const Eigen::Vector3d position = map_from_world_ * flight_.truth.bundle.points[points_[f]];
      landmark = map.add_landmark(position, id, static_cast<int>(f));
    }
    for (const InertialLink& link : flight_.truth.links) {
      if (link.to != index || !map.at(id).previous.valid()) continue;
      map.set_motion(id, motion_of(map, link));
    }
    return id;
  }

  Map make(int keyframes) {
    Map map = blank();
    for (int i = 0; i < keyframes; ++i) add(map, i);
    return map;
  }

 private:
  SE3 true_camera(std::size_t index) const {
    const BundleProblem& truth = flight_.truth.bundle;
    return truth.world_from_body[index] * truth.rig.body_from_camera[0];
  }

  Eigen::Vector2d exact_pixel(const BundleObservation& seen) const {
    const BundleProblem& truth = flight_.truth.bundle;
    const SE3 camera = true_camera(static_cast<std::size_t>(seen.pose));
    const Eigen::Vector3d& point = truth.points[static_cast<std::size_t>(seen.point)];
    return *truth.rig.cameras[0].project(camera.inverse() * point);
  }

  // Cut for the offset of the clock that the map has found.
  std::shared_ptr<const Preintegration> motion_of(const Map& map, const InertialLink& link) const {
    const Timestamp offset = map.calibration().time_offset;
    if (offset == 0) return std::make_shared<const Preintegration>(link.motion);
    std::vector<Preintegration> all;
    for (const InertialLink& other : flight_.truth.links) all.push_back(other.motion);
    auto samples = joined_samples(all, {}, offset).between(link.motion.begin(), link.motion.end());
    return std::make_shared<const Preintegration>(link.motion.over(std::move(samples)));
  }

  // One feature per point that camera 0 sees.
  Frame make_frame(int index, const SE3& world_from_body) {
    auto features = std::make_shared<FeatureSet>();
    auto stereo = std::make_shared<std::vector<StereoObservation>>();
    Frame frame;
    frame.id = {index};
    frame.time = index < static_cast<int>(flight_.truth.links.size())
                     ? flight_.truth.links[static_cast<std::size_t>(index)].motion.begin()
                     : flight_.truth.links.back().motion.end();
    frame.world_from_body = world_from_body;
    points_.clear();
    Eigen::Vector2d left_error = Eigen::Vector2d::Zero();  // shared by the partner
    for (const BundleObservation& seen : flight_.truth.bundle.observations) {
      if (seen.pose != index) continue;
      const auto sigma = static_cast<float>(seen.sigma);
      if (seen.camera == 0) {
        points_.push_back(static_cast<std::size_t>(seen.point));
        frame.observations.push_back({{}, seen.pixel.cast<float>(), sigma, false, false});
        features->positions.push_back(seen.pixel.cast<float>());
        features->sigmas.push_back(sigma);
        stereo->emplace_back();
        left_error = seen.pixel - exact_pixel(seen);
      } else if (!points_.empty() && points_.back() == static_cast<std::size_t>(seen.point)) {
        stereo->back().pixel = (seen.pixel + left_error).cast<float>();
        stereo->back().sigma = sigma;
      }
    }
    features->descriptors = Descriptors::Zero(static_cast<Eigen::Index>(points_.size()), 64);
    features->image_size = {rig_->cameras[0].width(), rig_->cameras[0].height()};
    frame.features = std::move(features);
    if (rig_->size() > 1) frame.stereo = std::move(stereo);
    return frame;
  }

  const SimulatedFlight& flight_;
  double scale_;  // of a map that is begun
  Sim3 map_from_world_;
  std::shared_ptr<const Rig> rig_;
  std::vector<LandmarkId> landmarks_;  // of each point
  std::vector<std::size_t> points_;    // of each feature of the frame made last
};

}  // namespace rover
