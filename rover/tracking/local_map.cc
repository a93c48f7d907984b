#include "rover/tracking/local_map.h"

#include <set>

#include "rover/base/error.h"

namespace rover {
namespace {

void add_family(const Map& map, std::set<KeyframeId>& keyframes) {
  const std::vector<KeyframeId> voters(keyframes.begin(), keyframes.end());
  for (const KeyframeId id : voters) {
    const Keyframe& keyframe = map.at(id);
    if (keyframe.parent.valid()) keyframes.insert(keyframe.parent);
    keyframes.insert(keyframe.children.begin(), keyframe.children.end());
  }
}

void add_recent(const Map& map, int count, std::set<KeyframeId>& keyframes) {
  KeyframeId id = map.newest_keyframe();
  for (int i = 0; i < count && id.valid(); ++i, id = map.at(id).parent) keyframes.insert(id);
}

}  // namespace

void LocalMapOptions::check() const {
  require(max_keyframes > 0, "local_map.max_keyframes is {}; use 1 or more", max_keyframes);
}

LocalMap choose_local_map(const Map& map, const Frame& frame, KeyframeId fallback,
                          const LocalMapOptions& options) {
  LocalMap local;
  local.reference = fallback;
  std::set<KeyframeId> keyframes{fallback};
  const auto voters = map.observers(frame.landmarks());
  if (!voters.empty()) local.reference = voters.front().keyframe;
  for (const auto& voter : voters) {
    if (static_cast<int>(keyframes.size()) == options.max_keyframes) break;
    keyframes.insert(voter.keyframe);
  }
  add_family(map, keyframes);
  add_recent(map, options.recent_keyframes, keyframes);
  std::set<LandmarkId> landmarks;
  for (const KeyframeId id : keyframes) {
    for (const LandmarkId landmark : map.landmarks_of(id)) landmarks.insert(landmark);
  }
  local.landmarks.assign(landmarks.begin(), landmarks.end());
  return local;
}

}  // namespace rover
