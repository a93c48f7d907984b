#pragma once

#include "rover/map/map.h"

namespace rover {

// When a frame becomes a keyframe. Decided from data only, so that a run can be repeated.
struct KeyframePolicyOptions {
  double min_tracked_share = 0.7;  // of the reference keyframe's landmarks; fewer: new keyframe
  double max_parallax = 60;        // px, median motion of landmarks since the reference keyframe,
                                   // less what rotation explains; more: new keyframe
  double max_rotation = 20;        // deg since the reference keyframe
  int min_landmarks = 60;          // tracked; fewer, and fewer than the reference keyframe has: new
                                   // keyframe at once
  int min_near = 100;              // stereo: fewer near landmarks tracked than this, while ...
  int min_new_near = 70;           // ... so many more are to be had: new keyframe
  int min_inliers = 5;             // fewer: no keyframe, the pose is not sure enough
  int min_gap = 1;                 // frames between keyframes when the reason is not urgent
  // Inertial modes: while the body moves, keyframes are no farther apart than this.
  double max_gap = 0.5;  // s
  // Where more hangs on inertial data, which say most about accelerations of 1 Hz and faster: with
  // one camera, and until the map is aligned and its scale certain.
  double short_gap = 0.25;  // s
  // Afterwards, where fewer than sparse_landmarks are tracked. Nor are they closer together than
  // this because the landmarks fade (min_landmarks): the window of the adjustment would reach back
  // over too short a time.
  double sparse_gap = 0.15;  // s
  int sparse_landmarks = 100;
  double moving_parallax = 2;  // px since the reference keyframe: less is standing still ...
  double moving_rotation = 1;  // deg, likewise

  void check() const;
};

// What the decision looks at.
struct KeyframeEvidence {
  int inliers = 0;              // landmarks tracked in this frame
  int reference_landmarks = 0;  // well established ones of the reference keyframe
  double parallax = 0;          // px
  double rotation = 0;          // deg
  int frames_since_keyframe = 0;
  bool stereo = false;
  int near_tracked = 0;  // stereo: near landmarks tracked
  int near_new = 0;      // stereo: near features that are no landmarks
  bool inertial = false;
  bool settled = false;               // inertial: the map is aligned and its scale certain
  bool still = false;                 // inertial: the body stands still
  double seconds_since_keyframe = 0;  // inertial
};

bool wants_keyframe(const KeyframeEvidence& evidence, const KeyframePolicyOptions& options);

// Gathers the evidence for a tracked frame. near_depth: m, up to which a stereo point is near.
KeyframeEvidence gather_keyframe_evidence(const Map& map, const Frame& frame, KeyframeId reference,
                                          double near_depth);

}  // namespace rover
