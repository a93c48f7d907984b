#pragma once

#include <cstdint>
#include <memory>

#include "rover/map/map.h"
#include "rover/matching/matcher.h"
#include "rover/tracking/frame_pose.h"

namespace rover {

struct RelocalizationOptions {
  int min_matches = 12;        // with landmarks, before RANSAC
  int min_inliers = 10;        // after the pose adjustment
  double matched_share = 0.6;  // of the keyframe's features, those with landmarks first
  double ransac_sigma = 1.5;   // px: inliers lie within 2.4 times this
  int recent_keyframes = 10;   // tried when lost ...
  int tries_per_frame = 2;     // ... so many in each frame

  void check() const;
};

// Finds a frame's pose without any prediction: learned matching with one keyframe, P3P with RANSAC
// on the landmarks that it sees, pose adjustment. On success the frame is joined to the landmarks
// and has its pose; else it is left without landmarks and with the pose it had.
class Relocalizer {
 public:
  Relocalizer(std::shared_ptr<const Matcher> matcher, const RelocalizationOptions& options,
              const PoseOptimizationOptions& pose, const WeightingOptions& weighting,
              std::uint64_t seed);

  bool locate(const Map& map, KeyframeId keyframe, Frame& frame) const;

 private:
  bool solve_absolute_pose(const Map& map, Frame& frame) const;

  std::shared_ptr<const Matcher> matcher_;
  RelocalizationOptions options_;
  PoseOptimizationOptions pose_;
  WeightingOptions weighting_;
  std::uint64_t seed_;
};

// Parts a frame from all landmarks.
void clear_landmarks(Frame& frame);

// Matches a frame with one whose landmarks are known: with the given share of its features, first
// those with a landmark.
std::vector<Match> match_known(const Matcher& matcher, const Frame& known, const Frame& frame,
                               double share);

// Joins the features of `frame` to the landmarks that their partners in `known` see.
int transfer_landmarks(const Frame& known, const std::vector<Match>& matches, Frame& frame);

}  // namespace rover
