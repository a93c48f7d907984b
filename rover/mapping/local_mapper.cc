#include "rover/mapping/local_mapper.h"

#include <algorithm>
#include <utility>

#include "rover/base/error.h"
#include "rover/mapping/slant_learning.h"

namespace rover {

void LocalMapperOptions::check() const {
  creation.check();
  slant.check();
  adjustment.check();
  gaps.check();
  inertial.check();
  require(window > 1 && max_fixed >= 0,
          "mapping.window must be above 1 and max_fixed not negative");
  require(redundant_share > 0 && redundant_share <= 1,
          "mapping.redundant_share is {}; use a share up to 1", redundant_share);
  require(kept_images >= 2, "mapping.kept_images is {}; use 2 or more", kept_images);
}

LocalMapper::LocalMapper(const FeatureFamily& family, const LocalMapperOptions& options)
    : family_(family), options_(options), inertial_(options.inertial, options.creation.weighting) {
  options_.check();
}

MappingReport LocalMapper::process(SharedMap& map, KeyframeId keyframe,
                                   const std::function<bool()>& hurry) {
  MappingReport report;
  StageTimer timer(report.times);
  ++turn_;
  map.commit([&](Map& m) { report.culled_landmarks = cull_landmarks(m, keyframe); });
  timer.done("cull_landmarks");
  report.triangulation = triangulate(map, keyframe, hurry);
  timer.done("triangulate");
  map.commit([&](Map& m) { report.fused = fuse_duplicates(m, keyframe); });
  timer.done("fuse");
  if (options_.learn_slants) {
    const auto learned =
        learn_slants(*map.view(), keyframe, options_.slant, options_.creation.refinement);
    map.commit([&](Map& m) { commit_slants(m, keyframe, learned); });
    timer.done("slants");
  }
  report.inertial = adjust(map, keyframe, hurry);
  timer.done("local_adjustment");
  if (options_.is_inertial && report.inertial.event == InertialEvent::kNone) {
    report.inertial = inertial_.advance(map, keyframe);
    timer.done("inertial");
  }
  map.commit([&](Map& m) {
    report.culled_keyframes = cull_keyframes(m, keyframe);
    release_old_images(m, keyframe);
  });
  timer.done("cull_keyframes");
  return report;
}

// Young landmarks have to prove themselves: seen where they should be, and by enough keyframes.
int LocalMapper::cull_landmarks(Map& map, KeyframeId keyframe) {
  for (const LandmarkId id : map.landmarks_of(keyframe)) {
    if (map.at(id).created_by == keyframe) probation_.push_back({id, turn_});
  }
  int culled = 0;
  std::deque<Probation> remaining;
  for (const auto& [id, turn] : probation_) {
    const Landmark* landmark = map.find(id);
    if (!landmark) continue;
    if (is_weak(map, *landmark, turn_ - turn)) {
      map.remove(id);
      ++culled;
    } else if (turn_ - turn < options_.probation) {
      remaining.push_back({id, turn});
    }
  }
  probation_ = std::move(remaining);
  return culled;
}

bool LocalMapper::is_weak(const Map& map, const Landmark& landmark, int age) const {
  if (landmark.visible > 0 && landmark.found < options_.min_found_share * landmark.visible) {
    return true;
  }
  if (age < options_.probation - 1) return false;
  const auto wanted = std::min<std::size_t>(static_cast<std::size_t>(options_.min_observations),
                                            map.keyframes().size());
  return landmark.observations.size() < wanted;
}

// Each neighbour's landmarks are committed at once: tracking waits for them. The best neighbours
// are joined by the learned matcher; the others show much the same from elsewhere, and nearest
// neighbours find what they add at a tenth of the time. In a hurry only one is left to the former.
TriangulationCounts LocalMapper::triangulate(SharedMap& shared, KeyframeId keyframe,
                                             const std::function<bool()>& hurry) {
  TriangulationCounts total;
  std::vector<LandmarkId> created;
  int rank = 0;
  for (const KeyframeId id : choose_neighbours(*shared.view(), keyframe, options_.creation)) {
    const bool learned =
        rank < options_.creation.learned_neighbours && !(rank > 0 && hurry && hurry());
    ++rank;
    const Matcher& matcher = learned ? *family_.matcher : *family_.classical;
    const auto matches = match_neighbour(*shared.view(), keyframe, id, matcher, options_.creation);
    shared.commit([&](Map& map) {
      total += apply_matches(map, keyframe, matches, options_.creation, created);
    });
  }
  for (const LandmarkId id : created) probation_.push_back({id, turn_});
  return total;
}

InertialReport LocalMapper::adjust(SharedMap& map, KeyframeId keyframe,
                                   const std::function<bool()>& hurry) {
  BundleOptions options = options_.adjustment;
  options.should_stop = hurry;
  if (map.view()->inertial().aligned) {
    return inertial_.adjust_window(map, keyframe, options_.max_fixed, options);
  }
  adjust_window(map, keyframe, options);
  return {};
}

void LocalMapper::adjust_window(SharedMap& shared, KeyframeId keyframe,
                                const BundleOptions& options) const {
  const auto view = shared.view();
  std::vector<KeyframeId> free{keyframe};
  for (const auto& neighbour : view->covisible(keyframe)) {
    if (static_cast<int>(free.size()) == options_.window) break;
    free.push_back(neighbour.keyframe);
  }
  if (view->keyframes().size() < 2) return;
  MapProblem problem = gather_problem(*view, free, options_.max_fixed, options_.creation.weighting);
  const BundleSummary summary = rover::adjust(problem, options);
  shared.commit([&](Map& map) { commit_adjustment(map, problem, summary); });
}

int LocalMapper::cull_keyframes(Map& map, KeyframeId keyframe) const {
  int culled = 0;
  for (const auto& neighbour : map.covisible(keyframe)) {
    if (!is_redundant(map, neighbour.keyframe, keyframe, options_.redundant_share)) continue;
    if (options_.is_inertial && leaves_gap(map, neighbour.keyframe, keyframe, options_.gaps)) {
      continue;
    }
    map.retire(neighbour.keyframe);
    ++culled;
  }
  return culled;
}

void LocalMapper::release_old_images(Map& map, KeyframeId keyframe) {
  with_image_.push_back(keyframe);
  while (static_cast<int>(with_image_.size()) > options_.kept_images) {
    map.release_image(with_image_.front());
    with_image_.pop_front();
  }
}

}  // namespace rover
