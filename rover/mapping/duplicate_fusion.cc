// The step of local mapping that finds landmarks which are the same point.

#include <algorithm>
#include <set>

#include "rover/map/visibility.h"
#include "rover/mapping/local_mapper.h"
#include "rover/mapping/reprojection_check.h"

namespace rover {
namespace {

constexpr double kMaxViewAngle = 45;  // deg
constexpr double kReferenceWidth = 640;

}  // namespace

int LocalMapper::fuse_duplicates(Map& map, KeyframeId keyframe) const {
  auto neighbours = map.covisible(keyframe);
  const auto wanted = static_cast<std::size_t>(options_.fusion_neighbours);
  if (neighbours.size() > wanted) neighbours.resize(wanted);
  int fused = 0;
  std::set<LandmarkId> around;
  for (const auto& neighbour : neighbours) {
    fused += fuse_into(map, neighbour.keyframe, map.landmarks_of(keyframe));
    const auto seen = map.landmarks_of(neighbour.keyframe);
    around.insert(seen.begin(), seen.end());
  }
  return fused + fuse_into(map, keyframe, {around.begin(), around.end()});
}

// Looks for landmarks in a keyframe that does not list them: where one is found, the keyframe sees
// it too, or what it sees there is the same landmark under another id.
int LocalMapper::fuse_into(Map& map, KeyframeId target,
                           const std::vector<LandmarkId>& landmarks) const {
  const Camera& camera = map.rig().cameras[0];
  const Frame& frame = map.at(target).frame;
  const auto features = frame.features;
  const SE3 world_from_camera = map.world_from_camera(frame);
  const auto radius = static_cast<float>(options_.fusion_radius * camera.width() / kReferenceWidth);
  std::vector<GuidedQuery> queries;
  std::vector<LandmarkId> ids;
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = map.find(id);
    if (!landmark || landmark->has_observation(target)) continue;
    const auto pixel = predict_pixel(*landmark, camera, world_from_camera, kMaxViewAngle);
    if (!pixel) continue;
    queries.push_back({pixel->cast<float>(), radius, landmark->appearance->descriptor.data()});
    ids.push_back(id);
  }
  const LandmarkCreationOptions& options = options_.creation;
  int fused = 0;
  for (const Match& match : match_guided(queries, FeatureGrid(*features), family_.guided)) {
    const LandmarkId id = ids[static_cast<std::size_t>(match.a)];
    if (!map.find(id)) continue;
    const LandmarkId there = map.at(target).frame[match.b].landmark;
    if (there.valid()) {
      fused += fuse_checked(map, id, there, options);
    } else if (reprojection_chi2(map, map.at(id).position, target, match.b, options.weighting) <
               options.chi2) {
      fused += observe_refined(map, id, target, match.b, options.refinement);
    }
  }
  return fused;
}

}  // namespace rover
