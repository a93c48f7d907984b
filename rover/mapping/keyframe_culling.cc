#include "rover/mapping/keyframe_culling.h"

#include "rover/base/error.h"

namespace rover {
namespace {

constexpr std::size_t kEnoughOthers = 3;

bool is_recent(const Map& map, KeyframeId candidate, KeyframeId newest, int window) {
  KeyframeId id = newest;
  for (int i = 0; i < window && id.valid(); ++i, id = map.at(id).previous) {
    if (id == candidate) return true;
  }
  return false;
}

bool leans_on_inertia(const Map& map, const Keyframe& keyframe, const CullingGaps& gaps) {
  return map.rig().size() == 1 || keyframe.frame.landmark_count() < gaps.sparse_landmarks;
}

}  // namespace

void CullingGaps::check() const {
  require(close > 0 && recent >= close && old >= recent,
          "mapping.short_gap must be positive, at most recent_gap, and that at most old_gap");
  require(settled > 0, "mapping.settled_after is {}; use a positive number of seconds", settled);
}

bool leaves_gap(const Map& map, KeyframeId candidate, KeyframeId newest, const CullingGaps& gaps) {
  const Keyframe& keyframe = map.at(candidate);
  if (!keyframe.previous.valid() || !keyframe.next.valid()) return true;
  const bool aligned = map.inertial().aligned;
  const Timestamp now = map.at(newest).frame.time;
  if (aligned && seconds_between(keyframe.frame.time, now) > gaps.settled) return false;
  const double gap =
      seconds_between(map.at(keyframe.previous).frame.time, map.at(keyframe.next).frame.time);
  if (leans_on_inertia(map, keyframe, gaps)) return gap > gaps.close;
  const bool recent = !aligned || is_recent(map, candidate, newest, gaps.window);
  return gap > (recent ? gaps.recent : gaps.old);
}

bool is_redundant(const Map& map, KeyframeId candidate, KeyframeId newest, double share) {
  const Keyframe& keyframe = map.at(candidate);
  if (!keyframe.parent.valid()) return false;
  // The tracker leans on the newest keyframes; keyframes behind it may have come meanwhile.
  if (candidate >= newest || candidate == map.at(newest).parent) return false;
  const auto landmarks = map.landmarks_of(candidate);
  if (landmarks.empty()) return true;
  std::size_t redundant = 0;
  for (const LandmarkId id : landmarks) {
    redundant += map.at(id).observations.size() > kEnoughOthers;
  }
  return static_cast<double>(redundant) > share * static_cast<double>(landmarks.size());
}

}  // namespace rover
