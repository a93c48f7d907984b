#include "rover/mapping/triangulator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "rover/base/error.h"
#include "rover/base/quantile.h"
#include "rover/geometry/triangulation.h"
#include "rover/map/feature_choice.h"
#include "rover/mapping/reprojection_check.h"
#include "rover/matching/partial_matching.h"

namespace rover {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::size_t kConsidered = 15;  // covisible keyframes looked at
constexpr int kMinShared = 15;           // landmarks with a neighbour

double median_depth(const Map& map, KeyframeId id) {
  const Keyframe& keyframe = map.at(id);
  std::vector<double> depths;
  for (const LandmarkId landmark : map.landmarks_of(id)) {
    depths.push_back((map.at(landmark).position - keyframe.world_from_body().translation).norm());
  }
  return median(std::move(depths));
}

// One pair of features, and how they make a landmark.
class PairTriangulator {
 public:
  PairTriangulator(const Map& map, KeyframeId a, KeyframeId b,
                   const LandmarkCreationOptions& options)
      : map_(map),
        options_(options),
        a_(a),
        b_(b),
        pose_a_(map.world_from_camera(map.at(a).frame)),
        pose_b_(map.world_from_camera(map.at(b).frame)) {}

  std::optional<Eigen::Vector3d> point(int feature_a, int feature_b) const {
    auto point = by_parallax(feature_a, feature_b);
    if (!point) point = by_stereo(a_, feature_a);
    if (!point) point = by_stereo(b_, feature_b);
    if (!point || !fits(*point, a_, feature_a) || !fits(*point, b_, feature_b)) {
      return std::nullopt;
    }
    return point;
  }

 private:
  std::optional<Eigen::Vector3d> by_parallax(int feature_a, int feature_b) const {
    const Camera& camera = map_.rig().cameras[0];
    const auto ray_a = camera.unproject(pixel(a_, feature_a));
    const auto ray_b = camera.unproject(pixel(b_, feature_b));
    if (!ray_a || !ray_b) return std::nullopt;
    TriangulationOptions limits;
    limits.min_parallax = options_.min_parallax * kDegree;
    const std::array<ViewRay, 2> rays{ViewRay{pose_a_, *ray_a}, ViewRay{pose_b_, *ray_b}};
    const auto triangulated = triangulate(rays, limits);
    if (!triangulated) return std::nullopt;
    return triangulated->point;
  }

  std::optional<Eigen::Vector3d> by_stereo(KeyframeId keyframe, int feature) const {
    const Frame& frame = map_.at(keyframe).frame;
    const StereoObservation* stereo = frame.stereo_of(feature);
    if (!stereo) return std::nullopt;
    return frame.world_from_body * (map_.rig().body_from_camera[0] * stereo->point.cast<double>());
  }

  Eigen::Vector2d pixel(KeyframeId keyframe, int feature) const {
    return map_.at(keyframe).frame[feature].pixel.cast<double>();
  }

  bool fits(const Eigen::Vector3d& point, KeyframeId keyframe, int feature) const {
    return reprojection_chi2(map_, point, keyframe, feature, options_.weighting) < options_.chi2;
  }

  const Map& map_;
  const LandmarkCreationOptions& options_;
  KeyframeId a_, b_;
  SE3 pose_a_, pose_b_;
};

}  // namespace

void LandmarkCreationOptions::check() const {
  require(neighbours > 0, "mapping.neighbours is {}; use 1 or more", neighbours);
  require(learned_neighbours >= 0, "mapping.learned_neighbours is {}; use 0 or more",
          learned_neighbours);
  require(matched_share > 0 && matched_share <= 1,
          "mapping.matched_share is {}; use a share up to 1", matched_share);
  require(min_parallax > 0 && good_parallax > min_parallax,
          "mapping.min_parallax must be positive and below good_parallax");
  weighting.check();
  refinement.check();
}

std::vector<KeyframeId> choose_neighbours(const Map& map, KeyframeId keyframe,
                                          const LandmarkCreationOptions& options) {
  const double depth = median_depth(map, keyframe);
  const Eigen::Vector3d here = map.at(keyframe).world_from_body().translation;
  const auto baseline = [&](KeyframeId id) {  // of the depth
    return (map.at(id).world_from_body().translation - here).norm() / depth;
  };
  auto candidates = map.covisible(keyframe, kMinShared);
  if (candidates.size() > kConsidered) candidates.resize(kConsidered);
  std::vector<std::pair<double, KeyframeId>> scored;
  for (const auto& [id, shared] : candidates) {
    const double ratio = baseline(id);
    if (ratio < options.min_baseline) continue;
    const double parallax = std::min(std::atan(ratio) / kDegree, options.good_parallax);
    scored.emplace_back(-shared * parallax, id);
  }
  std::sort(scored.begin(), scored.end());
  std::vector<KeyframeId> chosen;
  const auto wanted = static_cast<std::size_t>(options.neighbours);
  for (const auto& [score, id] : scored) {
    if (chosen.size() < wanted) chosen.push_back(id);
  }
  KeyframeId before = map.at(keyframe).previous;
  for (std::size_t i = 0; i < kConsidered && before.valid() && chosen.size() < wanted; ++i) {
    const bool is_new = std::ranges::find(chosen, before) == chosen.end();
    if (is_new && baseline(before) >= options.min_baseline) chosen.push_back(before);
    before = map.at(before).previous;
  }
  return chosen;
}

NeighbourMatches match_neighbour(const Map& map, KeyframeId keyframe, KeyframeId neighbour,
                                 const Matcher& matcher, const LandmarkCreationOptions& options) {
  const Frame& a = map.at(keyframe).frame;
  const Frame& b = map.at(neighbour).frame;
  return {neighbour,
          match_some(matcher, {*a.features, &a.image},
                     choose_features(a, options.matched_share, Prefer::kWithoutLandmark),
                     {*b.features, &b.image},
                     choose_features(b, options.matched_share, Prefer::kWithoutLandmark))};
}

TriangulationCounts apply_matches(Map& map, KeyframeId keyframe, const NeighbourMatches& matches,
                                  const LandmarkCreationOptions& options,
                                  std::vector<LandmarkId>& created) {
  TriangulationCounts counts;
  const KeyframeId neighbour = matches.neighbour;
  if (!map.find(keyframe) || !map.find(neighbour)) return counts;
  const PairTriangulator triangulator(map, keyframe, neighbour, options);
  const auto join = [&](LandmarkId landmark, KeyframeId observer, int feature) {
    const double chi2 =
        reprojection_chi2(map, map.at(landmark).position, observer, feature, options.weighting);
    counts.joined += chi2 < options.chi2 &&
                     observe_refined(map, landmark, observer, feature, options.refinement);
  };
  for (const auto& [a, b, score] : matches.matches) {
    const LandmarkId landmark_a = map.at(keyframe).frame[a].landmark;
    const LandmarkId landmark_b = map.at(neighbour).frame[b].landmark;
    if (landmark_a.valid() && landmark_b.valid()) {
      counts.fused += fuse_checked(map, landmark_a, landmark_b, options);
    } else if (landmark_a.valid()) {
      join(landmark_a, neighbour, b);
    } else if (landmark_b.valid()) {
      join(landmark_b, keyframe, a);
    } else if (const auto point = triangulator.point(a, b)) {
      const LandmarkId landmark = map.add_landmark(*point, keyframe, a);
      if (!landmark.valid()) continue;
      observe_refined(map, landmark, neighbour, b, options.refinement);
      created.push_back(landmark);
      ++counts.created;
    }
  }
  return counts;
}

}  // namespace rover
