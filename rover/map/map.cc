#include "rover/map/map.h"

#include <algorithm>

#include "rover/map/appearance.h"

namespace rover {
namespace {

// s: a motion integrated over more tells nothing that vision does not know better.
constexpr double kLongestMerged = 10;

bool by_keyframe(const LandmarkObservation& observation, KeyframeId keyframe) {
  return observation.keyframe < keyframe;
}

// The place of a keyframe's observation in a landmark's list, or where it would be.
auto place_of(std::vector<LandmarkObservation>& observations, KeyframeId keyframe) {
  return std::lower_bound(observations.begin(), observations.end(), keyframe, by_keyframe);
}

std::vector<Covisibility> sorted(const std::map<KeyframeId, int>& votes, int min_shared) {
  std::vector<Covisibility> result;
  for (const auto& [keyframe, shared] : votes) {
    if (shared >= min_shared) result.push_back({keyframe, shared});
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const auto& a, const auto& b) { return a.shared > b.shared; });
  return result;
}

}  // namespace

std::vector<LandmarkId> Frame::landmarks() const {
  std::vector<LandmarkId> joined;
  for (const Observation& observation : observations) {
    if (observation.landmark.valid()) joined.push_back(observation.landmark);
  }
  return joined;
}

void Frame::unjoin(int feature) {
  const auto i = static_cast<std::size_t>(feature);
  observations[i] = {{}, features->positions[i], features->sigmas[i], false, false};
}

int Frame::landmark_count() const {
  return static_cast<int>(std::count_if(observations.begin(), observations.end(),
                                        [](const auto& o) { return o.landmark.valid(); }));
}

bool Landmark::has_observation(KeyframeId keyframe) const {
  const auto place =
      std::lower_bound(observations.begin(), observations.end(), keyframe, by_keyframe);
  return place != observations.end() && place->keyframe == keyframe;
}

Map::Map(MapId id, std::shared_ptr<const Rig> rig, std::shared_ptr<IdSource> ids)
    : id_(id), rig_(std::move(rig)), ids_(std::move(ids)) {}

KeyframeId Map::choose_parent(const Frame& frame) const {
  const auto candidates = observers(frame.landmarks());
  return candidates.empty() ? newest_ : candidates.front().keyframe;
}

KeyframeId Map::add_keyframe(Frame frame) {
  Keyframe keyframe;
  keyframe.id = ids_->next_keyframe();
  keyframe.parent = choose_parent(frame);
  std::vector<std::pair<LandmarkId, int>> joins;
  for (int i = 0; i < frame.size(); ++i) {
    if (frame[i].landmark.valid()) joins.emplace_back(frame[i].landmark, i);
    frame[i].landmark = {};
  }
  keyframe.frame = std::move(frame);
  if (keyframe.parent.valid()) keyframes_.edit(keyframe.parent).children.push_back(keyframe.id);
  keyframe.previous = newest_;
  if (!newest_.valid()) begin_ = keyframe.frame.time;
  if (newest_.valid()) keyframes_.edit(newest_).next = keyframe.id;
  newest_ = keyframe.id;
  keyframes_.insert(keyframe.id, std::move(keyframe));
  for (const auto& [landmark, feature] : joins) {
    if (!observe(landmark, newest_, feature)) keyframes_.edit(newest_).frame.unjoin(feature);
  }
  return newest_;
}

LandmarkId Map::add_landmark(const Eigen::Vector3d& position, KeyframeId keyframe, int feature) {
  const Frame& frame = at(keyframe).frame;
  auto appearance = make_appearance(rig_->cameras[0], frame, feature);
  if (!appearance) return {};
  Landmark landmark;
  landmark.id = ids_->next_landmark();
  landmark.position = position;
  landmark.appearance = std::move(appearance);
  landmark.world_from_reference = world_from_camera(frame);
  landmark.created_by = newest_;
  const LandmarkId id = landmark.id;
  const bool has_patch = landmark.appearance->has_patch;
  landmarks_.insert(id, std::move(landmark));
  // What the patch shows is seen here by definition, however roughly a detector found it.
  if (observe(id, keyframe, feature)) keyframes_.edit(keyframe).frame[feature].refined = has_patch;
  return id;
}

bool Map::observe(LandmarkId landmark, KeyframeId keyframe, int feature) {
  const Landmark* point = find(landmark);
  const Keyframe* observer = find(keyframe);
  if (!point || !observer || point->has_observation(keyframe)) return false;
  if (observer->frame[feature].landmark.valid()) return false;
  keyframes_.edit(keyframe).frame[feature].landmark = landmark;
  auto& observations = landmarks_.edit(landmark).observations;
  observations.insert(place_of(observations, keyframe), {keyframe, feature});
  return true;
}

void Map::forget(LandmarkId landmark, KeyframeId keyframe) {
  const Landmark* point = find(landmark);
  if (!point || !point->has_observation(keyframe)) return;
  auto& observations = landmarks_.edit(landmark).observations;
  const auto place = place_of(observations, keyframe);
  keyframes_.edit(keyframe).frame.unjoin(place->feature);
  observations.erase(place);
  if (observations.empty()) landmarks_.erase(landmark);
}

void Map::reject_stereo(LandmarkId landmark, KeyframeId keyframe) {
  const Landmark* point = find(landmark);
  if (!point || !point->has_observation(keyframe)) return;
  auto& observations = landmarks_.edit(landmark).observations;
  const int feature = place_of(observations, keyframe)->feature;
  keyframes_.edit(keyframe).frame[feature].stereo_rejected = true;
}

void Map::fuse(LandmarkId gone, LandmarkId kept) {
  if (gone == kept || !find(gone) || !find(kept)) return;
  const Landmark merged = at(gone);
  remove(gone);
  for (const auto& [keyframe, feature] : merged.observations) observe(kept, keyframe, feature);
  count_sighting(kept, merged.visible, merged.found);
}

void Map::remove(LandmarkId landmark) {
  const Landmark* point = find(landmark);
  if (!point) return;
  for (const auto& [keyframe, feature] : point->observations) {
    keyframes_.edit(keyframe).frame.unjoin(feature);
  }
  landmarks_.erase(landmark);
}

void Map::retire(KeyframeId id) {
  const Keyframe* found = find(id);
  if (!found || !found->parent.valid()) return;
  const Keyframe keyframe = *found;
  for (const LandmarkId landmark : landmarks_of(id)) forget(landmark, id);
  for (const KeyframeId child : keyframe.children) keyframes_.edit(child).parent = keyframe.parent;
  Keyframe& parent = keyframes_.edit(keyframe.parent);
  std::erase(parent.children, id);
  parent.children.insert(parent.children.end(), keyframe.children.begin(), keyframe.children.end());
  std::sort(parent.children.begin(), parent.children.end());
  retired_.insert(
      id, {id, keyframe.parent, parent.world_from_body().inverse() * keyframe.world_from_body()});
  bridge(keyframe);
  keyframes_.erase(id);
  if (newest_ == id) newest_ = keyframe.previous;
}

void Map::bridge(const Keyframe& gone) {
  if (gone.previous.valid()) keyframes_.edit(gone.previous).next = gone.next;
  if (!gone.next.valid()) return;
  Keyframe& next = keyframes_.edit(gone.next);
  next.previous = gone.previous;
  if (gone.motion && next.motion &&
      gone.motion->duration() + next.motion->duration() < kLongestMerged) {
    next.motion =
        std::make_shared<const Preintegration>(Preintegration::merged(*gone.motion, *next.motion));
  } else {
    next.motion.reset();
  }
}

void Map::set_pose(KeyframeId keyframe, const SE3& world_from_body) {
  if (find(keyframe)) keyframes_.edit(keyframe).frame.world_from_body = world_from_body;
}

void Map::set_position(LandmarkId landmark, const Eigen::Vector3d& position) {
  if (find(landmark)) landmarks_.edit(landmark).position = position;
}

void Map::set_slant(LandmarkId landmark, const Slant& slant) {
  if (find(landmark)) landmarks_.edit(landmark).slant = slant;
}

void Map::set_measurement(KeyframeId keyframe, int feature, const Eigen::Vector2f& pixel,
                          float sigma) {
  if (!find(keyframe)) return;
  Observation& observation = keyframes_.edit(keyframe).frame[feature];
  observation.pixel = pixel;
  observation.sigma = sigma;
  observation.refined = true;
}

void Map::count_sighting(LandmarkId landmark, int visible, int found) {
  if (!find(landmark)) return;
  Landmark& point = landmarks_.edit(landmark);
  point.visible += visible;
  point.found += found;
}

void Map::release_image(KeyframeId keyframe) {
  if (find(keyframe)) keyframes_.edit(keyframe).frame.image.release();
}

void Map::set_motion(KeyframeId keyframe, std::shared_ptr<const Preintegration> motion) {
  if (find(keyframe)) keyframes_.edit(keyframe).motion = std::move(motion);
}

void Map::set_velocity(KeyframeId keyframe, const Eigen::Vector3d& velocity, const ImuBias& bias) {
  if (!find(keyframe)) return;
  Keyframe& edited = keyframes_.edit(keyframe);
  edited.velocity = velocity;
  edited.bias = bias;
}

void Map::set_still(KeyframeId keyframe, double sigma) {
  if (find(keyframe)) keyframes_.edit(keyframe).still_sigma = sigma;
}

void Map::set_covariance(KeyframeId keyframe, std::shared_ptr<const StateCovariance> covariance) {
  if (find(keyframe)) keyframes_.edit(keyframe).covariance = std::move(covariance);
}

std::vector<Covisibility> Map::covisible(KeyframeId keyframe, int min_shared) const {
  auto votes = observers(landmarks_of(keyframe), min_shared);
  std::erase_if(votes, [&](const auto& vote) { return vote.keyframe == keyframe; });
  return votes;
}

std::vector<Covisibility> Map::observers(const std::vector<LandmarkId>& landmarks,
                                         int min_shared) const {
  std::map<KeyframeId, int> votes;
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = find(id);
    if (!landmark) continue;
    for (const auto& observation : landmark->observations) ++votes[observation.keyframe];
  }
  return sorted(votes, min_shared);
}

std::vector<LandmarkId> Map::landmarks_of(KeyframeId keyframe) const {
  const Keyframe* observer = find(keyframe);
  return observer ? observer->frame.landmarks() : std::vector<LandmarkId>();
}

bool Map::is_supported(const Landmark& landmark) const {
  if (landmark.observations.size() >= 2) return true;
  if (landmark.observations.empty()) return false;
  const auto& [keyframe, feature] = landmark.observations.front();
  const Frame& frame = at(keyframe).frame;
  return frame.stereo_of(feature) && !frame[feature].stereo_rejected;
}

KeyframeId Map::standing(KeyframeId keyframe) const {
  while (const RetiredKeyframe* retired = retired_.find(keyframe)) keyframe = retired->parent;
  return keyframe;
}

SE3 Map::world_from_any(KeyframeId keyframe) const {
  SE3 keyframe_from_asked;
  while (const RetiredKeyframe* retired = retired_.find(keyframe)) {
    keyframe_from_asked = retired->parent_from_body * keyframe_from_asked;
    keyframe = retired->parent;
  }
  return at(keyframe).world_from_body() * keyframe_from_asked;
}

void Map::freeze() {
  keyframes_.freeze();
  landmarks_.freeze();
  retired_.freeze();
}

}  // namespace rover
