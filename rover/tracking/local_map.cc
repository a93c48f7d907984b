#include "rover/tracking/local_map.h"

#include <algorithm>
#include <numbers>
#include <set>

#include "rover/base/error.h"
#include "rover/base/quantile.h"

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

// Of the landmarks that a frame sees, from its camera; 0 if it sees none.
double median_distance(const Map& map, const Frame& frame, const Eigen::Vector3d& camera) {
  std::vector<double> distances;
  for (const LandmarkId id : frame.landmarks()) {
    if (const Landmark* landmark = map.find(id))
      distances.push_back((landmark->position - camera).norm());
  }
  return median(std::move(distances));
}

// By distance and turn, each in units of its limit; keyframes beyond a limit are left out.
void add_near(const Map& map, const Frame& frame, const LocalMapOptions& options,
              std::set<KeyframeId>& keyframes) {
  const SE3 here = map.world_from_camera(frame);
  const double reach = options.near_distance * median_distance(map, frame, here.translation);
  const double turn = options.near_angle * std::numbers::pi / 180;
  std::vector<std::pair<double, KeyframeId>> near;
  for (const Keyframe& keyframe : map.keyframes()) {
    if (keyframes.contains(keyframe.id)) continue;
    const SE3 there = map.world_from_camera(keyframe.frame);
    const double distance = (there.translation - here.translation).norm();
    if (!(distance < reach)) continue;
    const double angle = here.rotation.angularDistance(there.rotation);
    if (angle < turn) near.emplace_back(distance / reach + angle / turn, keyframe.id);
  }
  const auto most = std::min(near.size(), static_cast<std::size_t>(options.near_keyframes));
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(most), near.end());
  for (std::size_t i = 0; i < most; ++i) keyframes.insert(near[i].second);
}

}  // namespace

void LocalMapOptions::check() const {
  require(max_keyframes > 0, "local_map.max_keyframes is {}; use 1 or more", max_keyframes);
  require(near_keyframes >= 0 && near_distance >= 0 && near_angle >= 0,
          "local_map.near_keyframes, near_distance and near_angle must not be negative");
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
  add_near(map, frame, options, keyframes);
  std::set<LandmarkId> landmarks;
  for (const KeyframeId id : keyframes) {
    for (const LandmarkId landmark : map.landmarks_of(id)) landmarks.insert(landmark);
  }
  local.landmarks.assign(landmarks.begin(), landmarks.end());
  return local;
}

}  // namespace rover
