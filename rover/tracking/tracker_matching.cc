// The steps of the tracker that match a frame to a map.

#include <algorithm>

#include "rover/tracking/tracker.h"

namespace rover {
LandmarkSearchOptions Tracker::search_options(double radius) const {
  LandmarkSearchOptions options = options_.search;
  options.radius = static_cast<float>(radius * pixel_scale_);
  return options;
}

bool Tracker::match_to_last(const Map& map, const FeatureGrid& grid, Frame& frame) {
  constexpr double kWidening = 2.5;  // of the gate, before the learned matcher is asked
  if (!options_.learned_tracking) {
    const SE3 predicted = frame.world_from_body;
    if (match_by_motion(map, grid, options_.motion_radius, frame)) return true;
    clear_landmarks(frame);
    frame.world_from_body = predicted;
    if (match_by_motion(map, grid, kWidening * options_.motion_radius, frame)) return true;
  }
  return match_by_learning(map, frame);
}

// The cheap question, where the prediction is good: each landmark of the last frame is looked for
// around its projection.
bool Tracker::match_by_motion(const Map& map, const FeatureGrid& grid, double radius,
                              Frame& frame) {
  search_landmarks(map, last_->landmarks(), search_options(radius), grid, frame);
  const auto temporary = search_temporary(grid, radius, frame);
  const FramePose solved = solve_pose(map, frame, temporary);
  return solved.estimate.converged &&
         solved.landmarks + solved.temporary >= options_.confident_inliers;
}

// Stereo points of the last frame that are no landmarks (yet) help to find the pose.
std::vector<TemporaryPoint> Tracker::search_temporary(const FeatureGrid& grid, double radius,
                                                      const Frame& frame) const {
  std::vector<TemporaryPoint> points;
  if (!last_->stereo) return points;
  const Camera& camera = rig_->cameras[0];
  const SE3 camera_from_world = (frame.world_from_body * rig_->body_from_camera[0]).inverse();
  const SE3 world_from_last = last_->world_from_body * rig_->body_from_camera[0];
  const double near = near_depth(*rig_, options_.stereo);
  std::vector<GuidedQuery> queries;
  for (int i = 0; i < last_->size(); ++i) {
    const StereoObservation* stereo = last_->stereo_of(i);
    if (!stereo || (*last_)[i].landmark.valid() || !is_near(*stereo, near, options_.stereo)) {
      continue;
    }
    const Eigen::Vector3d point = world_from_last * stereo->point.cast<double>();
    const auto pixel = camera.project(camera_from_world * point);
    if (!pixel || !camera.contains(*pixel)) continue;
    queries.push_back({pixel->cast<float>(), static_cast<float>(radius * pixel_scale_),
                       last_->features->descriptors.row(i).data()});
    points.push_back({point, -1});
  }
  std::vector<char> free(frame.observations.size());
  for (int i = 0; i < frame.size(); ++i) {
    free[static_cast<std::size_t>(i)] = !frame[i].landmark.valid();
  }
  std::vector<TemporaryPoint> found;
  for (const Match& match : match_guided(queries, grid, options_.search.guided, free)) {
    found.push_back({points[static_cast<std::size_t>(match.a)].point, match.b});
  }
  return found;
}

// Where the prediction is not certain, the learned matcher joins the frame to the last one.
bool Tracker::match_by_learning(const Map& map, Frame& frame) {
  clear_landmarks(frame);
  frame.world_from_body = last_->world_from_body;
  const auto matches =
      match_known(*family_.matcher, *last_, frame, options_.relocalization.matched_share);
  transfer_landmarks(*last_, matches, frame);
  const SE3 world_from_last = map.world_from_camera(*last_);
  std::vector<TemporaryPoint> temporary;
  for (const Match& match : matches) {
    const StereoObservation* stereo = last_->stereo_of(match.a);
    if (!stereo || frame[match.b].landmark.valid()) continue;
    temporary.push_back({world_from_last * stereo->point.cast<double>(), match.b});
  }
  const FramePose solved = solve_pose(map, frame, temporary);
  return solved.estimate.converged && solved.landmarks + solved.temporary >= needed_inliers();
}

bool Tracker::match_to_reference(const Map& map, Frame& frame) {
  frame.world_from_body = last_->world_from_body;
  return relocalizer_.locate(map, reference_, frame);
}

// The last keyframes, a few in each frame, in turn.
bool Tracker::relocalize(const Map& map, Frame& frame) {
  std::vector<KeyframeId> recent;
  KeyframeId id = map.newest_keyframe();
  const auto wanted = static_cast<std::size_t>(options_.relocalization.recent_keyframes);
  for (; id.valid() && recent.size() < wanted; id = map.at(id).parent) recent.push_back(id);
  const int tries =
      std::min<int>(options_.relocalization.tries_per_frame, static_cast<int>(recent.size()));
  for (int i = 0; i < tries; ++i) {
    const auto turn = static_cast<std::size_t>(relocalization_turn_++) % recent.size();
    if (!relocalizer_.locate(map, recent[turn], frame)) continue;
    reference_ = recent[turn];
    return true;
  }
  return false;
}

bool Tracker::track_local_map(const Map& map, const FeatureGrid& grid, Frame& frame,
                              TrackingResult& result) {
  const LocalMap local = choose_local_map(map, frame, reference_, options_.local_map);
  std::vector<LandmarkId> sought = frame.landmarks();
  search_landmarks(map, local.landmarks, search_options(options_.local_radius), grid, frame,
                   &sought);
  FramePose solved = solve_pose(map, frame);
  result.matches = frame.landmark_count();
  if (options_.refine && solved.estimate.converged) {
    refine_observations(map, options_.refinement, frame);
    solved = solve_pose(map, frame);
  }
  result.inliers = solved.landmarks;
  result.covariance = solved.estimate.covariance;
  if (!solved.estimate.converged || solved.landmarks < needed_inliers()) return false;
  reference_ = local.reference;
  for (const LandmarkId id : sought) ++sightings_[id].first;
  for (const LandmarkId id : frame.landmarks()) ++sightings_[id].second;
  return true;
}

}  // namespace rover
