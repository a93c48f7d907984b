#include "rover/geometry/two_view.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "rover/base/quantile.h"
#include "rover/geometry/homography.h"
#include "rover/geometry/triangulation.h"

namespace rover {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kChiSquare95OneDegree = 3.841;

// Torr's criterion with his constants for data of four dimensions (two bearings): the residuals,
// each bounded, and the price of the structure (d per pair) and of the model's parameters (k).
template <class SquaredError>
double gric(int count, int structure_dimension, int parameters, double sigma,
            const SquaredError& squared_error) {
  constexpr double kDataDimension = 4, kBound = 2;
  const double limit = kBound * (kDataDimension - structure_dimension);
  double sum = std::log(kDataDimension) * structure_dimension * count +
               std::log(kDataDimension * count) * parameters;
  for (int i = 0; i < count; ++i) {
    const double error = squared_error(i) / (sigma * sigma);
    sum += error < limit ? error : limit;
  }
  return sum;
}

// One pose of a decomposition and what the pairs say about it.
struct Candidate {
  SE3 second_from_first;
  std::vector<int> inliers;
  std::vector<std::optional<Eigen::Vector3d>> points;
  int point_count = 0;
  double median_parallax = 0;  // rad
};

class TwoViewEstimator {
 public:
  TwoViewEstimator(std::span<const BearingPair> pairs, const TwoViewOptions& options)
      : pairs_(pairs), options_(options) {}

  TwoViewEstimate run() {
    if (count() < std::max(options_.min_points, 8)) return {{}, TwoViewFailure::kTooFewPairs};
    const auto essential = estimate_essential(pairs_, options_.sigma(), options_.ransac);
    const auto homography = estimate_homography(pairs_, options_.sigma(), options_.ransac);
    if (!enough(essential) && !enough(homography)) return {{}, TwoViewFailure::kNoModel};
    if (homography_is_better(essential, homography))
      return choose(decompose_homography(homography->model), TwoViewModel::kHomography);
    const auto poses = decompose_essential(essential->model);
    return choose({poses.begin(), poses.end()}, TwoViewModel::kEssential);
  }

 private:
  using Estimate = std::optional<RansacResult<Eigen::Matrix3d>>;

  int count() const { return static_cast<int>(pairs_.size()); }

  bool enough(const Estimate& estimate) const {
    return estimate && static_cast<int>(estimate->inliers.size()) >= options_.min_points;
  }

  bool homography_is_better(const Estimate& essential, const Estimate& homography) const {
    if (!enough(essential) || !enough(homography)) return enough(homography);
    const double by_essential = gric(count(), 3, 5, options_.sigma(), [&](int i) {
      return epipolar_squared_error(essential->model, pairs_[i]);
    });
    const double by_homography = gric(count(), 2, 8, options_.sigma(), [&](int i) {
      return homography_squared_error(homography->model, pairs_[i]);
    });
    return by_homography < by_essential;
  }

  std::optional<Eigen::Vector3d> point_of(const BearingPair& pair, const SE3& first_from_second) {
    const ViewRay rays[] = {{SE3(), pair.first}, {first_from_second, pair.second}};
    constexpr double kBound = 3;
    const auto result = triangulate(rays, {.min_parallax = options_.min_point_parallax * kDegree,
                                           .max_error = kBound * options_.sigma()});
    return result ? std::optional(result->point) : std::nullopt;
  }

  Candidate examine(const SE3& pose) {
    const double threshold = kChiSquare95OneDegree * options_.sigma() * options_.sigma();
    const Eigen::Matrix3d essential = essential_from_pose(pose);
    const SE3 first_from_second = pose.inverse();
    Candidate candidate{pose, {}, {}, 0, 0};
    candidate.points.resize(pairs_.size());
    std::vector<double> parallaxes;
    for (int i = 0; i < count(); ++i) {
      if (!(epipolar_squared_error(essential, pairs_[i]) < threshold)) continue;
      const double parallax = angle_between(pose.rotation * pairs_[i].first, pairs_[i].second);
      candidate.points[i] = point_of(pairs_[i], first_from_second);
      // With enough parallax but no point, the rays meet behind a camera.
      if (!candidate.points[i] && parallax > options_.min_point_parallax * kDegree) continue;
      candidate.inliers.push_back(i);
      candidate.point_count += candidate.points[i].has_value();
      parallaxes.push_back(parallax);
    }
    candidate.median_parallax = median(std::move(parallaxes));
    return candidate;
  }

  TwoViewEstimate choose(const std::vector<SE3>& poses, TwoViewModel model) {
    if (poses.empty()) return {{}, TwoViewFailure::kLowParallax};
    std::vector<Candidate> candidates;
    for (const SE3& pose : poses) candidates.push_back(examine(pose));
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const auto& a, const auto& b) { return a.point_count > b.point_count; });
    if (const auto failure = judge(candidates)) return {{}, failure};
    return {result_of(std::move(candidates[0]), model), {}};
  }

  std::optional<TwoViewFailure> judge(const std::vector<Candidate>& candidates) const {
    const Candidate& best = candidates[0];
    if (hardly_moved(candidates)) return TwoViewFailure::kLowParallax;
    if (best.point_count < options_.min_points) return TwoViewFailure::kTooFewPoints;
    if (candidates[1].point_count > options_.max_second_share * best.point_count)
      return TwoViewFailure::kAmbiguous;
    return std::nullopt;
  }

  // Of the poses that nearly all pairs fit, since the wrong ones show any parallax.
  bool hardly_moved(const std::vector<Candidate>& candidates) const {
    std::size_t most = 0;
    for (const auto& candidate : candidates) most = std::max(most, candidate.inliers.size());
    return std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& candidate) {
      return 10 * candidate.inliers.size() > 9 * most &&
             candidate.median_parallax < options_.min_median_parallax * kDegree;
    });
  }

  static TwoViewResult result_of(Candidate candidate, TwoViewModel model) {
    return {candidate.second_from_first,         std::move(candidate.inliers),
            std::move(candidate.points),         candidate.point_count,
            candidate.median_parallax / kDegree, model};
  }

  std::span<const BearingPair> pairs_;
  const TwoViewOptions& options_;
};

}  // namespace

void TwoViewOptions::check() const {
  ransac.check();
  require(sigma_px > 0, "two views: sigma_px must be positive");
  require(focal_length > 0, "two views: focal_length must be positive");
  require(min_points >= 1, "two views: min_points must be positive");
  require(min_median_parallax >= 0, "two views: min_median_parallax must not be negative");
  require(min_point_parallax >= 0, "two views: min_point_parallax must not be negative");
  require(max_second_share > 0 && max_second_share < 1,
          "two views: max_second_share must lie between 0 and 1");
}

std::string_view describe(TwoViewFailure failure) {
  switch (failure) {
    case TwoViewFailure::kTooFewPairs:
      return "too few matches between the views";
    case TwoViewFailure::kNoModel:
      return "the matches agree on no motion";
    case TwoViewFailure::kLowParallax:
      return "too little parallax: move sideways";
    case TwoViewFailure::kTooFewPoints:
      return "too few points in front of both views";
    case TwoViewFailure::kAmbiguous:
      return "two motions explain the matches equally well";
  }
  return "";
}

TwoViewEstimate estimate_two_view(std::span<const BearingPair> pairs,
                                  const TwoViewOptions& options) {
  options.check();
  return TwoViewEstimator(pairs, options).run();
}

}  // namespace rover
