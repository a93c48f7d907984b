#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
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
  KeyframeId newest_keyframe() const { return newest_; }

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
  // trajectories. The first keyframe of a map stays.
  void retire(KeyframeId keyframe);

  void set_pose(KeyframeId keyframe, const SE3& world_from_body);
  void set_position(LandmarkId landmark, const Eigen::Vector3d& position);
  void set_measurement(KeyframeId keyframe, int feature, const Eigen::Vector2f& pixel, float sigma);
  void count_sighting(LandmarkId landmark, int visible, int found);
  void release_image(KeyframeId keyframe);

  // Moves everything by new_world_from_world and raises the epoch.
  void transform(const Sim3& new_world_from_world);

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

  MapId id_;
  std::shared_ptr<const Rig> rig_;
  std::shared_ptr<IdSource> ids_;
  int epoch_ = 0;
  KeyframeId newest_;
  CowTable<KeyframeId, Keyframe> keyframes_;
  CowTable<LandmarkId, Landmark> landmarks_;
  CowTable<KeyframeId, RetiredKeyframe> retired_;
};

}  // namespace rover
