#include "rover/mapping/slant_learning.h"

#include "rover/map/appearance.h"

namespace rover {

std::vector<LearnedSlant> learn_slants(const Map& map, KeyframeId keyframe,
                                       const SlantOptions& options,
                                       const PatchRefinementOptions& refinement) {
  const Frame& frame = map.at(keyframe).frame;
  const Camera& camera = map.rig().cameras[0];
  const SE3 camera_from_world = map.camera_from_world(frame);
  std::vector<LearnedSlant> learned;
  for (int i = 0; i < frame.size(); ++i) {
    const Landmark* seen = map.find(frame[i].landmark);
    if (!seen) continue;
    const auto slant =
        learn_slant(*seen, camera, camera_from_world, frame.image, options, frame[i]);
    if (!slant) continue;
    Landmark landmark = *seen;
    landmark.slant = *slant;
    LearnedSlant& entry = learned.emplace_back(landmark.id, *slant, i, frame[i]);
    refine_observation(landmark, camera, camera_from_world, frame.image, refinement,
                       entry.observed);
  }
  return learned;
}

void commit_slants(Map& map, KeyframeId keyframe, const std::vector<LearnedSlant>& learned) {
  for (const auto& [landmark, slant, feature, observed] : learned) {
    if (!map.find(keyframe) || map.at(keyframe).frame[feature].landmark != landmark) continue;
    map.set_slant(landmark, slant);
    if (observed.refined) map.set_measurement(keyframe, feature, observed.pixel, observed.sigma);
  }
}

}  // namespace rover
