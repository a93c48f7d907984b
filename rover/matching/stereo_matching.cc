#include "rover/matching/stereo_matching.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Dense>

#include "rover/base/error.h"
#include "rover/matching/kernels.h"
#include "rover/matching/patch_refinement.h"
#include "rover/matching/stereo_candidates.h"

namespace rover {

void StereoMatchingOptions::check() const {
  require(min_similarity > 0 && min_similarity <= 1,
          "stereo matching: min_similarity must be in (0, 1], not {}", min_similarity);
  require(epipolar_gate > 0, "stereo matching: epipolar_gate must be positive, not {}",
          epipolar_gate);
  require(min_depth > 0 && max_depth > min_depth,
          "stereo matching: 0 < min_depth < max_depth does not hold for {}, {}", min_depth,
          max_depth);
  require(max_unaligned_sigma >= 0,
          "stereo matching: max_unaligned_sigma must not be negative, but is {}",
          max_unaligned_sigma);
}

namespace {

// px per axis, of a right feature that could not be aligned with the left image: these lie about a
// pixel off their epipolar lines (docs/matching.md).
constexpr float kUnalignedSigma = 1.0f;

// Mutually most similar candidates; -1 for left features without partner.
std::vector<int> best_partners(const FeatureSet& left, const FeatureSet& right,
                               const StereoCandidates& search, float min_similarity) {
  const auto size = static_cast<int>(right.descriptors.cols());
  std::vector<int> best_right(left.size(), -1), best_left(right.size(), -1), candidates;
  std::vector<float> best_similarity(right.size(), min_similarity), similarities;
  for (int i = 0; i < left.size(); ++i) {
    search.find(i, candidates);
    similarities.resize(candidates.size());
    matching_kernels().similarities(left.descriptors.row(i).data(), right.descriptors.data(), size,
                                    candidates.data(), static_cast<int>(candidates.size()),
                                    similarities.data());
    float best = min_similarity;
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      const int j = candidates[k];
      if (similarities[k] > best) {
        best = similarities[k];
        best_right[i] = j;
      }
      if (similarities[k] > best_similarity[j]) {
        best_similarity[j] = similarities[k];
        best_left[j] = i;
      }
    }
  }
  for (int i = 0; i < left.size(); ++i) {
    if (best_right[i] >= 0 && best_left[best_right[i]] != i) best_right[i] = -1;
  }
  return best_right;
}

// A point on the left ray, as the right camera sees it.
struct Sighting {
  Eigen::Vector3d point;     // left camera frame
  Eigen::Vector2d pixel;     // right image
  Matrix23d jacobian;        // of that pixel by the point in the right camera frame
  Eigen::Vector2d by_depth;  // derivative of the pixel by the distance along the left ray
};

class StereoTriangulation {
 public:
  StereoTriangulation(const Camera& right, const SE3& right_from_left)
      : right_(right), right_from_left_(right_from_left) {}

  std::optional<Sighting> see(const Eigen::Vector3d& left_ray, double distance) const {
    Sighting sighting;
    sighting.point = distance * left_ray;
    const auto pixel = right_.project(right_from_left_ * sighting.point, &sighting.jacobian);
    if (!pixel) return std::nullopt;
    sighting.pixel = *pixel;
    sighting.by_depth = sighting.jacobian * (right_from_left_.rotation * left_ray);
    return sighting;
  }

  // The point of the left ray that projects closest to a right pixel: Gauss-Newton over inverse
  // distance, in which the pixel moves nearly linearly, from where the rays come closest.
  std::optional<Sighting> triangulate(const Eigen::Vector3d& left_ray,
                                      const Eigen::Vector2d& target) const {
    const auto right_ray = right_.unproject(target);
    if (!right_ray) return std::nullopt;
    const Eigen::Vector3d normal = (right_from_left_.rotation * left_ray).cross(*right_ray);
    const double along = -right_from_left_.translation.cross(*right_ray).dot(normal);
    double inverse = normal.squaredNorm() / along;
    for (int i = 0; i < 2; ++i) {
      if (!(along > 0 && inverse > 0)) return std::nullopt;
      const auto sighting = see(left_ray, 1 / inverse);
      if (!sighting) return std::nullopt;
      const Eigen::Vector2d by_inverse = sighting->by_depth / -(inverse * inverse);
      inverse += by_inverse.dot(target - sighting->pixel) / by_inverse.squaredNorm();
    }
    if (!(inverse > 0)) return std::nullopt;
    return see(left_ray, 1 / inverse);
  }

  // How the surface at a point maps small offsets in the left image to the right one. The surface
  // is taken to face the left camera (which is exact between rectified images), or the ray where
  // that is far off the optical axis.
  Eigen::Matrix2f warp(const ObservedRay& left_ray, const Sighting& sighting) const {
    const Eigen::Vector3d& ray = left_ray.direction;
    const Eigen::Vector3d normal = ray.z() > 0.5 ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : ray;
    Eigen::Matrix<double, 3, 2> tangents;
    tangents.col(0) = normal.unitOrthogonal();
    tangents.col(1) = normal.cross(tangents.col(0));
    const double distance = sighting.point.norm();
    const Eigen::Matrix2d in_left = left_ray.jacobian * tangents / distance;
    const Eigen::Matrix2d in_right =
        sighting.jacobian * right_from_left_.rotation_matrix() * tangents;
    return (in_right * in_left.inverse()).cast<float>();
  }

 private:
  const Camera& right_;
  const SE3& right_from_left_;
};

class PairMaker {
 public:
  PairMaker(const FeatureSet& left, const cv::Mat& left_image, const FeatureSet& right,
            const cv::Mat& right_image, const Rig& rig, const StereoCandidates& search,
            const StereoMatchingOptions& options)
      : left_(left),
        left_image_(left_image),
        right_(right),
        right_image_(right_image),
        search_(search),
        options_(options),
        triangulation_(rig.cameras[1], search.right_from_left()) {}

  std::optional<StereoMatch> make(int i, int j) const {
    const ObservedRay& ray = search_.left_ray(i);
    const float sigma = std::hypot(left_.sigmas[i], right_.sigmas[j]);
    StereoMatch match;
    match.left = i;
    match.right = j;
    match.position = right_.positions[j];
    match.sigma = options_.refine ? std::max(sigma, kUnalignedSigma) : sigma;
    auto sighting = triangulation_.triangulate(ray.direction, match.position.cast<double>());
    if (!sighting) return std::nullopt;
    if (options_.refine) sighting = confirm(ray, *sighting, sigma, match);
    if (!sighting) return std::nullopt;
    const double error = (sighting->pixel - match.position.cast<double>()).norm();
    const double distance = sighting->point.norm();
    if (error > search_.gate(left_.sigmas[i], right_.sigmas[j]) || distance < options_.min_depth ||
        distance > options_.max_depth) {
      return std::nullopt;
    }
    match.point = sighting->point;
    match.depth_sigma = static_cast<float>(match.sigma / sighting->by_depth.norm());
    return match;
  }

 private:
  // The sighting after alignment; as it is, where the features are corners without doubt.
  std::optional<Sighting> confirm(const ObservedRay& ray, const Sighting& sighting, float sigma,
                                  StereoMatch& match) const {
    if (refine(ray, sighting, match)) {
      return triangulation_.triangulate(ray.direction, match.position.cast<double>());
    }
    if (sigma > options_.max_unaligned_sigma) return std::nullopt;
    return sighting;
  }

  // Replaces the right feature's own position by one aligned with the left image.
  bool refine(const ObservedRay& ray, const Sighting& sighting, StereoMatch& match) const {
    const auto patch = cut_patch(left_image_, left_.positions[match.left]);
    if (!patch) return false;
    const auto refined = refine_position(*patch, right_image_, match.position,
                                         triangulation_.warp(ray, sighting), refinement_);
    if (!refined) return false;
    match.position = refined->position;
    match.sigma = refined->sigma;
    return true;
  }

  const FeatureSet& left_;
  const cv::Mat& left_image_;
  const FeatureSet& right_;
  const cv::Mat& right_image_;
  const StereoCandidates& search_;
  const StereoMatchingOptions& options_;
  const StereoTriangulation triangulation_;
  // Far from the feature is no worse here: the epipolar line checks the result afterwards, and
  // below 1% of what aligns within 3 px is wrong (docs/matching.md).
  const PatchRefinementOptions refinement_{.max_shift = 3.0f};
};

}  // namespace

std::vector<StereoMatch> match_stereo(const FeatureSet& left, const cv::Mat& left_image,
                                      const FeatureSet& right, const cv::Mat& right_image,
                                      const Rig& rig, const StereoMatchingOptions& options) {
  require(rig.size() >= 2 && rig.baseline() > 0,
          "stereo matching needs a rig of two cameras that are apart");
  const StereoCandidates search(left, right, rig, options);
  const auto partners = best_partners(left, right, search, options.min_similarity);
  const PairMaker maker(left, left_image, right, right_image, rig, search, options);
  std::vector<StereoMatch> matches;
  for (int i = 0; i < left.size(); ++i) {
    if (partners[i] < 0) continue;
    if (const auto match = maker.make(i, partners[i])) matches.push_back(*match);
  }
  return matches;
}

}  // namespace rover
