#include "rover/tracking/landmark_search.h"

#include <unordered_set>

#include "rover/base/error.h"
#include "rover/map/appearance.h"

namespace rover {

void LandmarkSearchOptions::check() const {
  require(radius > 0, "search radius is {}; use a positive number of px", radius);
  require(max_view_angle > 0 && max_view_angle < 180, "max_view_angle is {}; use 0 to 180 deg",
          max_view_angle);
  guided.check();
}

int search_landmarks(const Map& map, std::span<const LandmarkId> landmarks,
                     const LandmarkSearchOptions& options, const FeatureGrid& grid, Frame& frame,
                     std::vector<LandmarkId>* sought) {
  const Camera& camera = map.rig().cameras[0];
  const SE3 world_from_camera = map.world_from_camera(frame);
  std::unordered_set<LandmarkId> seen;
  std::vector<char> free(frame.observations.size());
  for (int i = 0; i < frame.size(); ++i) {
    if (frame[i].landmark.valid()) seen.insert(frame[i].landmark);
    free[static_cast<std::size_t>(i)] = !frame[i].landmark.valid();
  }
  std::vector<GuidedQuery> queries;
  std::vector<LandmarkId> ids;
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = map.find(id);
    if (!landmark || seen.contains(id)) continue;
    const auto pixel = predict_pixel(*landmark, camera, world_from_camera, options.max_view_angle);
    if (!pixel) continue;
    queries.push_back(
        {pixel->cast<float>(), options.radius, landmark->appearance->descriptor.data()});
    ids.push_back(id);
  }
  const auto matches = match_guided(queries, grid, options.guided, free);
  for (const Match& match : matches) {
    frame[match.b].landmark = ids[static_cast<std::size_t>(match.a)];
  }
  if (sought) sought->insert(sought->end(), ids.begin(), ids.end());
  return static_cast<int>(matches.size());
}

int refine_observations(const Map& map, const PatchRefinementOptions& options, Frame& frame) {
  const Camera& camera = map.rig().cameras[0];
  const SE3 camera_from_world = map.camera_from_world(frame);
  int refined = 0;
  for (Observation& observation : frame.observations) {
    const Landmark* landmark = map.find(observation.landmark);
    if (!landmark || observation.refined) continue;
    refined +=
        refine_observation(*landmark, camera, camera_from_world, frame.image, options, observation);
  }
  return refined;
}

}  // namespace rover
