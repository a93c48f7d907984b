#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "rover/base/stage_times.h"
#include "rover/map/shared_map.h"
#include "rover/mapping/inertial_mapper.h"
#include "rover/mapping/keyframe_culling.h"
#include "rover/mapping/triangulator.h"
#include "rover/matching/feature_family.h"
#include "rover/optimization/map_adjustment.h"

namespace rover {

struct LocalMapperOptions {
  LandmarkCreationOptions creation;
  int fusion_neighbours = 8;  // covisible keyframes searched for duplicates by projection
  double fusion_radius = 3;   // px at 640 wide
  bool learn_slants = true;   // how landmarks' patches lean, from keyframes seen from elsewhere
  SlantOptions slant;
  int window = 12;     // free keyframes of the local adjustment
  int max_fixed = 20;  // fixed ones around it
  BundleOptions adjustment;
  double min_found_share = 0.25;  // of the frames that should have seen a young landmark
  int min_observations = 3;       // keyframes that see a landmark ...
  int probation = 3;              // ... so many keyframes after it was made
  double redundant_share = 0.9;   // of a keyframe's landmarks seen by three others: culled
  int kept_images = 20;           // newest keyframes whose images are kept for refinement
  CullingGaps gaps;               // inertial modes
  bool is_inertial = false;
  InertialMapperOptions inertial;

  void check() const;
};

// What the mapping of one keyframe did.
struct MappingReport {
  TriangulationCounts triangulation;
  int culled_landmarks = 0;
  int culled_keyframes = 0;
  int fused = 0;
  InertialReport inertial;
  StageTimes times;
};

// The second stage, for each keyframe. See DESIGN, section 2.
class LocalMapper {
 public:
  LocalMapper(const FeatureFamily& family, const LocalMapperOptions& options);

  // keyframe: committed to the map already. hurry, if set and true when asked (realtime: more
  // keyframes wait), shortens the adjustment and the list of neighbours; triangulation with the
  // best neighbour is never skipped.
  MappingReport process(SharedMap& map, KeyframeId keyframe,
                        const std::function<bool()>& hurry = {});

 private:
  struct Probation {
    LandmarkId landmark;
    int turn;  // keyframe count when it was made
  };
  int cull_landmarks(Map& map, KeyframeId keyframe);
  bool is_weak(const Map& map, const Landmark& landmark, int age) const;
  TriangulationCounts triangulate(SharedMap& map, KeyframeId keyframe,
                                  const std::function<bool()>& hurry);
  int fuse_duplicates(Map& map, KeyframeId keyframe) const;
  int fuse_into(Map& map, KeyframeId target, const std::vector<LandmarkId>& landmarks) const;
  InertialReport adjust(SharedMap& map, KeyframeId keyframe, const std::function<bool()>& hurry);
  void adjust_window(SharedMap& map, KeyframeId keyframe, const BundleOptions& options) const;
  int cull_keyframes(Map& map, KeyframeId keyframe) const;
  void release_old_images(Map& map, KeyframeId keyframe);

  FeatureFamily family_;
  LocalMapperOptions options_;
  InertialMapper inertial_;
  int turn_ = 0;
  std::deque<Probation> probation_;
  std::deque<KeyframeId> with_image_;
};

}  // namespace rover
