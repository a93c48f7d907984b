#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rover/camera/camera.h"
#include "rover/geometry/se3.h"
#include "rover/geometry/sim3.h"
#include "rover/map/cow_table.h"
#include "rover/map/keyframe.h"
#include "rover/map/landmark.h"

namespace rover {

// Ids that are unique over all maps of an atlas.
class IdSource {
 public:
  KeyframeId next_keyframe() { return {keyframe_++}; }
  LandmarkId next_landmark() { return {landmark_++}; }

 private:
  std::atomic<std::int64_t> keyframe_ = 0;
  std::atomic<std::int64_t> landmark_ = 0;
};

// Where a keyframe that was culled stays, relative to the one that stands in for it.
struct RetiredKeyframe {
  KeyframeId id;
  KeyframeId parent;
  SE3 parent_from_body;
};

// What inertial data have made of a map.
struct InertialStatus {
  bool aligned = false;        // gravity, velocities and biases are known, and the scale is metric
  Timestamp begin = 0;         // of the keyframe at which it was aligned
  Timestamp refined = 0;       // of the keyframe at which the whole map was last adjusted
  int refinements = 0;         // adjustments of the whole map since it was aligned
  double scale_sigma = 0;      // relative, posterior standard deviation
  bool scale_settled = false;  // that is as small as is wanted; or the rig tells the scale
  Timestamp undone = 0;  // of the keyframe at which an alignment turned out wrong; 0: none did
};

// What is known of how the cameras stand to the inertial sensor, where that is estimated: see
// CalibrationOptions.
struct CalibrationStatus {
  Timestamp time_offset = 0;  // ns, taken from the inertial sensor's stamps as given
  std::optional<SE3> given;   // body_from_camera of camera 0 as given; nothing: as in the rig
  Timestamp estimated = 0;    // of the keyframe at which it was last estimated; 0: never
  int estimates = 0;          // that were certain enough
  int changes = 0;            // of what is in force
  bool settled = false;       // certain, and the last estimate changed nothing
  double time_sigma = 0;      // s; 0: not estimated
  Eigen::Vector3d rotation_sigma = Eigen::Vector3d::Zero();     // rad, about the camera's axes
  Eigen::Vector3d translation_sigma = Eigen::Vector3d::Zero();  // m, along them
  std::string missing;  // what the last estimate lacked, in plain words
};

// What poses relative to keyframes that are kept outside a map are expressed in.
struct MapUnits {
  double scale = 1;      // the unit of length in units that the map began with
  SE3 body_from_camera;  // of camera 0: where the body is
};

// A keyframe and the number of landmarks it shares with another.
struct Covisibility {
  KeyframeId keyframe;
  int shared = 0;
};

// Keyframes, landmarks and who sees what. A value: a copy is a snapshot and costs little (see
// CowTable). Observations are kept on both sides, and every function here keeps them consistent:
// feature f of keyframe k is joined to landmark l if and only if l lists (k, f).
class Map {
 public:
  Map(MapId id, std::shared_ptr<const Rig> rig, std::shared_ptr<IdSource> ids);

  MapId id() const { return id_; }
  const Rig& rig() const { return *rig_; }
  const std::shared_ptr<const Rig>& shared_rig() const { return rig_; }
  // Raised by each change of gauge: scale, gravity, loops, merges.
  int epoch() const { return epoch_; }

  const CowTable<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  const CowTable<LandmarkId, Landmark>& landmarks() const { return landmarks_; }
  const Keyframe* find(KeyframeId id) const { return keyframes_.find(id); }
  const Landmark* find(LandmarkId id) const { return landmarks_.find(id); }
  const Keyframe& at(KeyframeId id) const { return keyframes_.at(id); }
  const Landmark& at(LandmarkId id) const { return landmarks_.at(id); }
  // Of camera 0 of a frame that is placed in this map.
  SE3 world_from_camera(const Frame& frame) const {
    return frame.world_from_body * rig_->body_from_camera[0];
  }
  SE3 camera_from_world(const Frame& frame) const { return world_from_camera(frame).inverse(); }
  KeyframeId newest_keyframe() const { return newest_; }
  Timestamp begin() const { return begin_; }  // of the first keyframe

  // Adds a keyframe. Joins of its observations to landmarks that are gone are dropped; the others
  // are entered on the landmarks' side.
  KeyframeId add_keyframe(Frame frame);

  // Adds a landmark seen in a keyframe's feature, from which it takes its appearance.
  LandmarkId add_landmark(const Eigen::Vector3d& position, KeyframeId keyframe, int feature);

  // Joins a landmark to a feature that is free; nothing happens (and false is returned) if either
  // is gone, the feature is taken, or the keyframe sees the landmark already.
  bool observe(LandmarkId landmark, KeyframeId keyframe, int feature);
  // The opposite. A landmark without observations is removed.
  void forget(LandmarkId landmark, KeyframeId keyframe);

  // Marks the stereo partner of an observation as not fitting; the observation stays.
  void reject_stereo(LandmarkId landmark, KeyframeId keyframe);

  // Moves the observations of one landmark to another and removes it.
  void fuse(LandmarkId gone, LandmarkId kept);
  void remove(LandmarkId landmark);

  // Culls a keyframe: its children go to its parent, and the parent stands in for it in
  // trajectories; its neighbours in time become each other's, with the motions of both intervals as
  // one. The first keyframe of a map stays.
  void retire(KeyframeId keyframe);

  void set_pose(KeyframeId keyframe, const SE3& world_from_body);
  // Moves one keyframe or landmark as `transform` does all of them.
  void move(KeyframeId keyframe, const Sim3& new_world_from_world);
  void move(LandmarkId landmark, const Sim3& new_world_from_world);
  void set_position(LandmarkId landmark, const Eigen::Vector3d& position);
  void set_slant(LandmarkId landmark, const Slant& slant);
  void set_measurement(KeyframeId keyframe, int feature, const Eigen::Vector2f& pixel, float sigma);
  void count_sighting(LandmarkId landmark, int visible, int found);
  void release_image(KeyframeId keyframe);

  // Moves everything by new_world_from_world and raises the epoch. Cameras move (body frames follow
  // them rigidly: extrinsics stay metric), velocities turn and scale with them. Covariances are
  // forgotten.
  void transform(const Sim3& new_world_from_world);

  // The present unit of length in units that the map began with.
  double scale() const { return scale_; }
  // Poses relative to keyframes that are kept outside the map have to follow as these change.
  MapUnits units() const { return {scale_, rig_->body_from_camera[0]}; }
  // Tells that an adjustment has changed the unit of length: keyframes and landmarks are where they
  // belong, poses kept relative to them follow.
  void rescale(double factor);
  // A pose relative to another one, kept when the units were `then`, in today's.
  SE3 rescale_relative(const SE3& a_from_b, const MapUnits& then) const;

  // The rig turns out to sit elsewhere in the body (camera 0 as given here, the others with it):
  // cameras and landmarks stay where they are, bodies move. Raises the epoch.
  void move_rig(const SE3& body_from_camera);
  const CalibrationStatus& calibration() const { return calibration_; }
  void set_calibration(const CalibrationStatus& status) { calibration_ = status; }
  // Inertial readings from the newest keyframe's stamp on, as far as they were there.
  const std::vector<ImuSample>& readings_after() const { return readings_after_; }
  void set_readings_after(std::vector<ImuSample> samples) { readings_after_ = std::move(samples); }

  const InertialStatus& inertial() const { return inertial_; }
  void set_inertial(const InertialStatus& status) { inertial_ = status; }
  void set_motion(KeyframeId keyframe, std::shared_ptr<const Preintegration> motion);
  void set_velocity(KeyframeId keyframe, const Eigen::Vector3d& velocity, const ImuBias& bias);
  // Tells that the body stood still at a keyframe, up to `sigma` m/s.
  void set_still(KeyframeId keyframe, double sigma);
  void set_covariance(KeyframeId keyframe, std::shared_ptr<const StateCovariance> covariance);
  // For adjustments that may move the whole map at once.
  void raise_epoch() { ++epoch_; }

  // Keyframes that share landmarks with one (or with a set of landmarks), most first, then by id.
  std::vector<Covisibility> covisible(KeyframeId keyframe, int min_shared = 1) const;
  std::vector<Covisibility> observers(const std::vector<LandmarkId>& landmarks,
                                      int min_shared = 1) const;
  std::vector<LandmarkId> landmarks_of(KeyframeId keyframe) const;

  // Whether a landmark has the two rays that make a point: two views, or one with its stereo
  // partner.
  bool is_supported(const Landmark& landmark) const;

  // The keyframe that stands in for one that may have been culled (itself, if it has not).
  KeyframeId standing(KeyframeId keyframe) const;
  // The pose of a keyframe that may have been culled, through those that stand in for it.
  SE3 world_from_any(KeyframeId keyframe) const;

  // Everything so far becomes immutable: see CowTable.
  void freeze();

 private:
  KeyframeId choose_parent(const Frame& frame) const;
  void bridge(const Keyframe& gone);
  void move_body(KeyframeId keyframe, const SE3& new_from_old);

  MapId id_;
  std::shared_ptr<const Rig> rig_;
  std::shared_ptr<IdSource> ids_;
  int epoch_ = 0;
  double scale_ = 1;
  InertialStatus inertial_;
  CalibrationStatus calibration_;
  std::vector<ImuSample> readings_after_;
  KeyframeId newest_;
  Timestamp begin_ = 0;
  CowTable<KeyframeId, Keyframe> keyframes_;
  CowTable<LandmarkId, Landmark> landmarks_;
  CowTable<KeyframeId, RetiredKeyframe> retired_;
};

}  // namespace rover
