#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "rover/camera/camera.h"
#include "rover/geometry/two_view.h"
#include "rover/map/frame.h"
#include "rover/matching/matcher.h"

namespace rover {

struct MonoInitializerOptions {
  int min_features = 100;  // a frame with fewer is no reference
  int min_matches = 60;    // fewer: the reference is given up for the current frame
  double min_motion = 12;  // px at 640 wide, median motion of matches before a solution is tried
  double preview_share = 0.4;  // of the features, tried first: all follow once these succeed
  int max_pending = 60;        // frames kept, to be placed once there is a map
  int max_reference_age = 90;  // frames after which the reference is given up
  TwoViewOptions two_view;

  void check() const;
};

// Two views that make a map.
struct InitialViews {
  Frame first;   // pose: identity
  Frame second;  // pose set; unit baseline
  struct Point {
    Eigen::Vector3d position;  // frame of the first camera
    int first = -1;            // features
    int second = -1;
  };
  std::vector<Point> points;
};

// Looks for two frames with enough parallax to begin a monocular map: learned matching with a
// reference frame, then essential matrix or homography by evidence (see two_view.h).
class MonoInitializer {
 public:
  MonoInitializer(std::shared_ptr<const Rig> rig, std::shared_ptr<const Matcher> matcher,
                  const MonoInitializerOptions& options, std::uint64_t seed);

  // Offers the next frame. On success the views; frames in between stay pending.
  std::optional<InitialViews> offer(Frame frame);

  // The frames seen so far that became no view, oldest first; forgets them.
  std::vector<Frame> take_pending();
  void reset();

  // The same cameras elsewhere in the body.
  void set_rig(std::shared_ptr<const Rig> rig) { rig_ = std::move(rig); }

 private:
  std::optional<std::vector<Match>> join(const Frame& frame, double share) const;
  std::optional<InitialViews> try_views(const Frame& frame, const std::vector<Match>& few) const;
  std::optional<InitialViews> solve(const Frame& frame, const std::vector<Match>& matches,
                                    double share) const;
  void replace_reference(Frame frame);
  void keep(Frame frame);

  std::shared_ptr<const Rig> rig_;
  std::shared_ptr<const Matcher> matcher_;
  MonoInitializerOptions options_;
  std::uint64_t seed_;
  std::optional<Frame> reference_;
  std::deque<Frame> pending_;
};

}  // namespace rover
