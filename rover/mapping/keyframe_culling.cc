#include "rover/mapping/keyframe_culling.h"

namespace rover {
namespace {

constexpr std::size_t kEnoughOthers = 3;

}  // namespace

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
