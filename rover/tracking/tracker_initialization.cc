// The steps of the tracker that begin a map.

#include <algorithm>

#include "rover/tracking/initial_map.h"
#include "rover/tracking/tracker.h"

namespace rover {

void Tracker::begin_map(Frame frame, TrackingResult& result) {
  if (frame.stereo) {
    begin_stereo_map(std::move(frame), result);
  } else if (rig_->size() == 1) {
    begin_mono_map(std::move(frame), result);
  }
}

void Tracker::begin_stereo_map(Frame frame, TrackingResult& result) {
  const auto& stereo = *frame.stereo;
  const auto points =
      std::count_if(stereo.begin(), stereo.end(), [](const auto& point) { return point.valid(); });
  if (points < options_.min_stereo_points) return;
  clear_landmarks(frame);
  frame.world_from_body = rig_->body_from_camera[0].inverse();
  map_ = atlas_->begin_map();
  reference_ = map_->commit([&](Map& map) { return insert_keyframe(map, frame, options_.stereo); });
  const auto view = map_->view();
  frame.observations = view->at(reference_).frame.observations;
  result.inliers = result.matches = frame.landmark_count();
  result.map_begun = true;
  result.new_keyframe = reference_;
  state_ = TrackingState::kWaiting;
  sightings_.clear();
  accept(frame, *view, result);
  frames_since_keyframe_ = 0;
}

void Tracker::begin_mono_map(Frame frame, TrackingResult& result) {
  clear_landmarks(frame);
  auto views = initializer_.offer(std::move(frame));
  if (!views) return;
  const Frame first = views->first;
  const Frame second = views->second;
  auto trial = std::make_shared<SharedMap>(atlas_->blank_map());
  const KeyframeId keyframe = trial->commit([&](Map& map) {
    const KeyframeId built =
        build_initial_map(map, std::move(*views), options_.initialization.min_matches,
                          options_.refinement, options_.weighting, options_.initial_adjustment);
    if (built.valid()) enter_inertia(map, built);
    return built;
  });
  if (!keyframe.valid()) return;
  atlas_->add_map(trial);
  map_ = trial;
  const auto view = map_->view();
  const KeyframeId origin = (*view->keyframes().begin()).id;
  result.earlier.push_back({first.id, first.time, view->id(), origin, SE3(), view->units()});
  reference_ = keyframe;
  state_ = TrackingState::kWaiting;
  sightings_.clear();
  place_pending(*view, result);
  const Frame& placed = view->at(keyframe).frame;
  result.inliers = result.matches = placed.landmark_count();
  result.map_begun = true;
  result.new_keyframe = keyframe;
  accept(placed, *view, result);
  frames_since_keyframe_ = 0;
}

// Frames that came before there was a map find their place in it, from the newest to the oldest,
// each near the one after it.
void Tracker::place_pending(const Map& map, TrackingResult& result) {
  auto pending = initializer_.take_pending();
  SE3 neighbour = map.at(map.newest_keyframe()).world_from_body();
  for (auto frame = pending.rbegin(); frame != pending.rend(); ++frame) {
    frame->world_from_body = neighbour;
    if (!place(map, *frame)) continue;
    neighbour = frame->world_from_body;
    result.earlier.push_back(anchor(map, *frame, map.newest_keyframe()));
  }
  std::sort(result.earlier.begin(), result.earlier.end(),
            [](const auto& a, const auto& b) { return a.time < b.time; });
}

bool Tracker::place(const Map& map, Frame& frame) {
  const FeatureGrid grid(*frame.features);
  std::vector<LandmarkId> landmarks;
  for (const Landmark& landmark : map.landmarks()) landmarks.push_back(landmark.id);
  clear_landmarks(frame);
  search_landmarks(map, landmarks, search_options(options_.motion_radius), grid, frame);
  FramePose solved = solve_frame_pose(map, options_.pose, options_.weighting, frame);
  if (!solved.estimate.converged || solved.landmarks < options_.confident_inliers) {
    if (!relocalizer_.locate(map, (*map.keyframes().begin()).id, frame)) return false;
  }
  search_landmarks(map, landmarks, search_options(options_.local_radius), grid, frame);
  solve_frame_pose(map, options_.pose, options_.weighting, frame);
  refine_observations(map, options_.refinement, frame);
  solved = solve_frame_pose(map, options_.pose, options_.weighting, frame);
  return solved.estimate.converged && solved.landmarks >= options_.min_inliers;
}

}  // namespace rover
