#include "rover/mapping/map_alignment.h"

#include <algorithm>

namespace rover {

std::vector<KeyframeId> linked_keyframes(const Map& map, KeyframeId newest, int most) {
  std::vector<KeyframeId> chain;
  for (KeyframeId id = newest; id.valid(); id = map.at(id).previous) {
    if (map.at(id).frame.time < map.inertial().undone) break;
    chain.push_back(id);
    if (!map.at(id).motion || static_cast<int>(chain.size()) == most) break;
  }
  std::ranges::reverse(chain);
  return chain;
}

InitializationProblem gather_initialization(const Map& map, const std::vector<KeyframeId>& chain) {
  InitializationProblem problem;
  problem.body_from_camera = map.rig().body_from_camera[0];
  problem.metric = map.rig().size() > 1;
  for (const KeyframeId id : chain) {
    problem.world_from_camera.push_back(map.at(id).world_from_body() * problem.body_from_camera);
    if (id != chain.front()) problem.motions.push_back(*map.at(id).motion);
  }
  return problem;
}

void align(Map& map, const std::vector<KeyframeId>& chain, const InitializationResult& result) {
  map.transform(result.aligned_from_world);
  for (std::size_t i = 0; i < chain.size(); ++i) {
    map.set_velocity(chain[i], result.states[i].velocity, result.states[i].bias);
  }
  const auto follow = [&](KeyframeId id) { return id.valid() ? map.at(id).next : id; };
  for (KeyframeId id = follow(chain.back()); id.valid(); id = follow(id)) {
    const Keyframe& keyframe = map.at(id);
    const InertialState before = map.at(keyframe.previous).state();
    const InertialState after =
        keyframe.motion ? keyframe.motion->predict(before, gravity_of_z_up()) : before;
    map.set_velocity(id, after.velocity, before.bias);
  }
}

}  // namespace rover
