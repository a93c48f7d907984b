#include "rover/mapping/slant_learning.h"

#include "rover/map/appearance.h"

namespace rover {

int learn_slants(Map& map, KeyframeId keyframe, const SlantOptions& options,
                 const PatchRefinementOptions& refinement) {
  const Frame frame = map.at(keyframe).frame;
  const Camera& camera = map.rig().cameras[0];
  const SE3 camera_from_world = (frame.world_from_body * map.rig().body_from_camera[0]).inverse();
  int learned = 0;
  for (int i = 0; i < frame.size(); ++i) {
    Observation observation = frame[i];
    const Landmark* landmark = map.find(observation.landmark);
    if (!landmark) continue;
    const auto slant =
        learn_slant(*landmark, camera, camera_from_world, frame.image, options, observation);
    if (!slant) continue;
    map.set_slant(landmark->id, *slant);
    ++learned;
    if (refine_observation(map.at(observation.landmark), camera, camera_from_world, frame.image,
                           refinement, observation)) {
      map.set_measurement(keyframe, i, observation.pixel, observation.sigma);
    }
  }
  return learned;
}

}  // namespace rover
