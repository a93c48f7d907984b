#include "rover/optimization/map_adjustment.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "rover/base/error.h"

namespace rover {
namespace {

// Fills a MapProblem from a map: which keyframes and landmarks take part is the caller's choice.
class Gatherer {
 public:
  Gatherer(const Map& map, const WeightingOptions& weighting) : map_(map), weighting_(weighting) {
    problem_.bundle.rig = map.rig();
    problem_.newest = map.newest_keyframe();
    problem_.epoch = map.epoch();
  }

  void add_keyframe(KeyframeId id, bool fixed) {
    poses_[id] = static_cast<int>(problem_.keyframes.size());
    problem_.keyframes.push_back(id);
    problem_.bundle.world_from_body.push_back(map_.at(id).world_from_body());
    problem_.bundle.pose_fixed.push_back(fixed);
  }

  // Adds a landmark with its observations in keyframes that were added; a landmark with too few
  // rays to be a point is left out.
  void add_landmark(LandmarkId id) {
    const Landmark& landmark = map_.at(id);
    const int point = static_cast<int>(problem_.landmarks.size());
    const std::size_t first = problem_.bundle.observations.size();
    for (const auto& [keyframe, feature] : landmark.observations) {
      const auto pose = poses_.find(keyframe);
      if (pose == poses_.end()) continue;
      add_observation(map_.at(keyframe).frame, feature, pose->second, point);
    }
    if (problem_.bundle.observations.size() < first + 2) {
      problem_.bundle.observations.resize(first);
      return;
    }
    problem_.landmarks.push_back(id);
    problem_.bundle.points.push_back(landmark.position);
  }

  MapProblem finish() {
    problem_.initial_poses = problem_.bundle.world_from_body;
    const auto& fixed = problem_.bundle.pose_fixed;
    problem_.needs_scale = !has_stereo_ && std::count(fixed.begin(), fixed.end(), 1) < 2;
    return std::move(problem_);
  }

 private:
  void add_observation(const Frame& frame, int feature, int pose, int point) {
    const auto add = [&](const Measurement& seen) {
      problem_.bundle.observations.push_back({pose, point, seen.camera, seen.pixel, seen.sigma});
    };
    const auto [place, disparity] = measurements_of(frame, feature, weighting_);
    add(place);
    if (!disparity) return;
    has_stereo_ = true;
    add(*disparity);
  }

  const Map& map_;
  const WeightingOptions& weighting_;
  MapProblem problem_;
  std::map<KeyframeId, int> poses_;
  bool has_stereo_ = false;
};

std::set<LandmarkId> landmarks_seen(const Map& map, const std::vector<KeyframeId>& keyframes) {
  std::set<LandmarkId> seen;
  for (const KeyframeId id : keyframes) {
    for (const LandmarkId landmark : map.landmarks_of(id)) seen.insert(landmark);
  }
  return seen;
}

void remove_outliers(Map& map, const MapProblem& problem, const std::vector<char>& inliers) {
  for (std::size_t i = 0; i < inliers.size(); ++i) {
    if (inliers[i]) continue;
    const BundleObservation& observation = problem.bundle.observations[i];
    const KeyframeId keyframe = problem.keyframes[static_cast<std::size_t>(observation.pose)];
    const LandmarkId landmark = problem.landmarks[static_cast<std::size_t>(observation.point)];
    if (observation.camera == 0) {
      map.forget(landmark, keyframe);
    } else {
      map.reject_stereo(landmark, keyframe);
    }
  }
}

void remove_unsupported(Map& map, const std::vector<LandmarkId>& landmarks) {
  for (const LandmarkId id : landmarks) {
    if (const Landmark* landmark = map.find(id); landmark && !map.is_supported(*landmark)) {
      map.remove(id);
    }
  }
}

// Keyframes made after the snapshot follow their parents, landmarks only they see follow them.
void move_newcomers(Map& map, const MapProblem& problem, double scale) {
  std::map<KeyframeId, Sim3> motions;
  for (std::size_t i = 0; i < problem.keyframes.size(); ++i) {
    motions[problem.keyframes[i]] = motion_of(problem, i, scale);
  }
  std::vector<KeyframeId> newcomers;
  for (const Keyframe& keyframe : map.keyframes()) {
    if (keyframe.id > problem.newest) newcomers.push_back(keyframe.id);
  }
  for (const KeyframeId id : newcomers) {
    const auto parent = motions.find(map.at(id).parent);
    if (parent == motions.end()) continue;
    const Sim3 motion = parent->second;
    motions[id] = motion;
    map.move(id, motion);
    for (const LandmarkId landmark : map.landmarks_of(id)) {
      if (map.at(landmark).observations.front().keyframe != id) continue;
      map.move(landmark, motion);
    }
  }
}

}  // namespace

void WeightingOptions::check() const {
  require(model_sigma >= 0 && model_sigma < 100, "model_sigma is {}; use 0 to 100 px", model_sigma);
  require(detection_sigma >= 0 && detection_sigma < 100, "detection_sigma is {}; use 0 to 100 px",
          detection_sigma);
  require(disparity_sigma >= 0 && disparity_sigma < 100, "disparity_sigma is {}; use 0 to 100 px",
          disparity_sigma);
}

double effective_sigma(const Observation& observation, const WeightingOptions& weighting) {
  return std::hypot(observation.sigma,
                    observation.refined ? weighting.model_sigma : weighting.detection_sigma);
}

double effective_disparity_sigma(double sigma, const WeightingOptions& weighting) {
  return std::hypot(sigma, weighting.disparity_sigma);
}

FeatureMeasurements measurements_of(const Frame& frame, int feature,
                                    const WeightingOptions& weighting) {
  const Observation& left = frame[feature];
  FeatureMeasurements measured;
  measured.place = {0, left.pixel.cast<double>(), effective_sigma(left, weighting)};
  const StereoObservation* right = frame.stereo_of(feature);
  if (right && !left.stereo_rejected) {
    measured.disparity = {kDisparity, frame.disparity(feature).cast<double>(),
                          effective_disparity_sigma(right->sigma, weighting)};
  }
  return measured;
}

MapProblem gather_problem(const Map& map, const std::vector<KeyframeId>& free, int max_fixed,
                          const WeightingOptions& weighting,
                          const std::vector<KeyframeId>& border) {
  const std::set<LandmarkId> seen = landmarks_seen(map, free);
  const std::set<KeyframeId> is_free(free.begin(), free.end());
  std::vector<KeyframeId> fixed = border;
  const std::size_t enough = border.size() + static_cast<std::size_t>(max_fixed);
  for (const auto& vote : map.observers({seen.begin(), seen.end()})) {
    if (fixed.size() == enough) break;
    if (is_free.contains(vote.keyframe) || std::ranges::count(border, vote.keyframe) > 0) continue;
    fixed.push_back(vote.keyframe);
  }
  Gatherer gatherer(map, weighting);
  for (const KeyframeId id : is_free) {
    gatherer.add_keyframe(id, fixed.empty() && id == *is_free.begin());
  }
  for (const KeyframeId id : fixed) gatherer.add_keyframe(id, true);
  for (const LandmarkId id : seen) gatherer.add_landmark(id);
  return gatherer.finish();
}

MapProblem gather_whole_map(const Map& map, const WeightingOptions& weighting) {
  Gatherer gatherer(map, weighting);
  bool first = true;
  for (const Keyframe& keyframe : map.keyframes()) {
    gatherer.add_keyframe(keyframe.id, first);
    first = false;
  }
  for (const Landmark& landmark : map.landmarks()) gatherer.add_landmark(landmark.id);
  return gatherer.finish();
}

BundleSummary adjust(MapProblem& problem, BundleOptions options) {
  options.fix_scale = problem.needs_scale;
  return adjust_bundle(problem.bundle, options);
}

void commit_adjustment(Map& map, const MapProblem& problem, const BundleSummary& summary,
                       double scale) {
  if (!summary.usable || map.epoch() != problem.epoch) return;
  for (std::size_t i = 0; i < problem.keyframes.size(); ++i) {
    if (problem.bundle.pose_fixed[i]) continue;
    map.set_pose(problem.keyframes[i], problem.bundle.world_from_body[i]);
  }
  for (std::size_t i = 0; i < problem.landmarks.size(); ++i) {
    map.set_position(problem.landmarks[i], problem.bundle.points[i]);
  }
  move_newcomers(map, problem, scale);
  remove_outliers(map, problem, summary.inliers);
  remove_unsupported(map, problem.landmarks);
}

Sim3 motion_of(const MapProblem& problem, std::size_t pose, double scale) {
  const SE3& body_from_camera = problem.bundle.rig.body_from_camera[0];
  const SE3 now = problem.bundle.world_from_body[pose] * body_from_camera;
  const SE3 then = problem.initial_poses[pose] * body_from_camera;
  return Sim3(now, scale) * Sim3(then).inverse();
}

}  // namespace rover
