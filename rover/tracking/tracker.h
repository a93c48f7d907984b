#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "rover/map/atlas.h"
#include "rover/matching/feature_family.h"
#include "rover/tracking/frame_pose.h"
#include "rover/tracking/inertial_tracking.h"
#include "rover/tracking/keyframe_insertion.h"
#include "rover/tracking/keyframe_policy.h"
#include "rover/tracking/landmark_search.h"
#include "rover/tracking/live_pose.h"
#include "rover/tracking/local_map.h"
#include "rover/tracking/mono_initializer.h"
#include "rover/tracking/relocalizer.h"
#include "rover/tracking/stillness.h"
#include "rover/tracking/tracking_result.h"

namespace rover {

struct TrackerOptions {
  double motion_radius = 20;   // px at 640 wide: gate around the position predicted by the motion
  double local_radius = 6;     // px at 640 wide: gate once the pose is known from the last frame
  int confident_inliers = 25;  // fewer after guided search from the last frame: learned matching
  int min_inliers = 10;        // fewer in the local map: lost
  bool learned_tracking = false;  // always match the last frame with the learned matcher
  bool refine = true;             // refine observations photometrically in every frame
  double max_lost = 2.0;          // s after which a new map may be begun ...
  double max_lost_young = 0.3;    // ... when the map lost has less than 5 keyframes
  int min_stereo_points = 25;     // to begin a map from one stereo frame
  LandmarkSearchOptions search;
  PatchRefinementOptions refinement;
  PoseOptimizationOptions pose;
  WeightingOptions weighting;
  LocalMapOptions local_map;
  KeyframePolicyOptions keyframe;
  StereoLandmarkOptions stereo;
  RelocalizationOptions relocalization;
  MonoInitializerOptions initialization;
  BundleOptions initial_adjustment;
  InertialTrackingOptions inertial;
  StillnessOptions still;
  LivePoseOptions live;

  void check() const;
};

// The first stage: where is each frame? See DESIGN, section 2.
class Tracker {
 public:
  Tracker(std::shared_ptr<Atlas> atlas, std::shared_ptr<const Rig> rig, const FeatureFamily& family,
          const TrackerOptions& options, std::uint64_t seed,
          const std::optional<ImuCalibration>& imu = {});

  // Inertial modes: readings, in order, up to the first one at or after each frame's time. False:
  // left out, as it is out of order or not finite.
  bool add_imu(const ImuSample& sample) { return inertial_->add(sample); }
  // ns that the map has found these readings' stamps to be too late by.
  Timestamp imu_time_offset() const { return inertial_ ? inertial_->time_offset() : 0; }
  TrackingResult track(Frame frame);
  // A frame whose image shows nothing new (the camera repeated itself): inertial data carry on, or
  // it is left out.
  TrackingResult skip(FrameId id, Timestamp time);
  // Inertial modes: the body stands still.
  bool still() const { return still_.still(); }

  // Matches of the last tracked frame, for the adaptive threshold; 0 while lost.
  int last_matches() const { return last_matches_; }
  // The map tracked in, or null before the first one.
  const std::shared_ptr<SharedMap>& active_map() const { return map_; }

 private:
  // Each step works on the view of the map taken when the frame came.
  bool locate(const Map& map, const FeatureGrid& grid, Frame& frame);
  void rebase(const Map& map);
  SE3 predict(Timestamp time);
  int needed_inliers() const;
  Eigen::Quaterniond predict_rotation(Timestamp time, const Eigen::Quaterniond& otherwise) const;
  FramePose solve_pose(const Map& map, Frame& frame,
                       const std::vector<TemporaryPoint>& temporary = {});
  bool match_to_last(const Map& map, const FeatureGrid& grid, Frame& frame);
  bool match_by_motion(const Map& map, const FeatureGrid& grid, double radius, Frame& frame);
  bool match_by_learning(const Map& map, Frame& frame);
  bool match_to_reference(const Map& map, Frame& frame);
  bool match_to_place(const Map& map, Frame& frame);
  bool relocalize(const Map& map, Frame& frame);
  bool track_local_map(const Map& map, const FeatureGrid& grid, Frame& frame,
                       TrackingResult& result);
  void decide_keyframe(const Map& map, const Frame& frame, TrackingResult& result);
  void begin_map(Frame frame, TrackingResult& result);
  void begin_stereo_map(Frame frame, TrackingResult& result);
  void begin_mono_map(Frame frame, TrackingResult& result);
  void place_pending(const Map& map, TrackingResult& result);
  bool place(const Map& map, Frame& frame);
  void accept(const Frame& frame, const Map& map, TrackingResult& result);
  void lose(const Frame& frame, TrackingResult& result);
  SE3 motion_since_given(const Frame& frame) const;
  void give(const Frame& frame, const Map& map, TrackingResult& result);
  void add_live_pose(TrackingResult& result);
  // Of inertial modes; without effect in others.
  void accept_state(const Frame& frame, const Map& map, TrackingResult& result);
  void note_rest(const Map& map);
  bool dead_reckon(const Map& map, const Frame& frame, TrackingResult& result);
  std::optional<SE3> predict_by_inertia(Timestamp time);
  bool is_blind(Timestamp now) const;
  void note_gap(const Frame& frame, TrackingResult& result);
  void correct_gap(const Map& map, TrackingResult& result);
  void enter_inertia(Map& map, KeyframeId keyframe) const;
  void forget_samples(Timestamp now);
  void follow(const Map& map);
  void take_calibration(const Map& map);
  SE3 pose_in(const Map& map, const Frame& frame, const TrackingResult& result) const;
  std::vector<TemporaryPoint> search_temporary(const FeatureGrid& grid, double radius,
                                               const Frame& frame) const;
  AnchoredPose anchor(const Map& map, const Frame& frame, KeyframeId reference) const;
  LandmarkSearchOptions search_options(double radius) const;
  bool may_begin_map(const Map* map, Timestamp now) const;

  std::shared_ptr<Atlas> atlas_;
  std::shared_ptr<const Rig> rig_;
  FeatureFamily family_;
  TrackerOptions options_;
  double pixel_scale_;  // image width / 640
  Relocalizer relocalizer_;
  MonoInitializer initializer_;
  std::unique_ptr<InertialTracking> inertial_;  // null in visual modes
  StillnessDetector still_;
  LivePoseFilter live_;
  std::optional<Timestamp> given_time_;  // of the last frame placed, if it had a state

  std::shared_ptr<SharedMap> map_;
  TrackingState state_ = TrackingState::kWaiting;
  std::optional<Frame> last_;  // the last frame tracked
  KeyframeId reference_;       // of the last frame
  SE3 reference_from_last_;
  SE3 reference_from_given_;  // the pose given last: tracked or, after that, dead reckoned
  SE3 world_from_given_;      // the same, in the map as it is now
  MapUnits units_;            // of the map then
  SE3 predicted_;             // pose of the frame under way
  Vector6d velocity_ = Vector6d::Zero();  // per second, body frame
  bool velocity_known_ = false;
  Timestamp lost_since_ = 0;
  int relocalization_turn_ = 0;
  int last_matches_ = 0;
  std::vector<AnchoredPose> reckoned_;  // frames without vision since the last one tracked
  int frames_since_keyframe_ = 0;
  std::map<LandmarkId, std::pair<int, int>> sightings_;  // visible, found; since last keyframe
};

}  // namespace rover
