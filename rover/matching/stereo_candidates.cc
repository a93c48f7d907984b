#include "rover/matching/stereo_candidates.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace rover {
namespace {

// Rays closer to the baseline's direction than this sine carry no depth and no plane.
constexpr double kMinSine = 0.05;

// Calibrations and positions are not better than this.
constexpr double kMinSigma = 0.75;  // px

double largest_sigma(const FeatureSet& features) {
  const auto largest = std::max_element(features.sigmas.begin(), features.sigmas.end());
  return largest == features.sigmas.end() ? 0 : *largest;
}

// px per radian across the epipolar plane, sine included: the gate's angle is the gate over this.
double plane_scale(const ObservedRay& ray, const Eigen::Vector3d& axis) {
  const Eigen::Vector3d normal = axis.cross(ray.direction);
  const double sine = normal.norm();
  if (!ray.valid || sine < kMinSine) return 0;
  // The distance is linear in the (small) angle, so that any small one will do.
  constexpr double kAngle = 1e-6;
  const Eigen::Vector3d turned = (normal / sine + kAngle * ray.direction).normalized();
  return plane_distance(turned, ray) / kAngle * sine;
}

}  // namespace

StereoCandidates::StereoCandidates(const FeatureSet& left, const FeatureSet& right, const Rig& rig,
                                   const StereoMatchingOptions& options)
    : left_(left),
      right_(right),
      options_(options),
      right_from_left_(rig.body_from_camera[1].inverse() * rig.body_from_camera[0]),
      axis_(right_from_left_.translation.normalized()),
      pixels_per_depth_(rig.cameras[1].focal_length() * rig.baseline()),
      left_rays_(observe_rays(rig.cameras[0], left.positions)),
      right_rays_(observe_rays(rig.cameras[1], right.positions)) {
  Eigen::Index smallest = 0;
  axis_.cwiseAbs().minCoeff(&smallest);
  zero_ = axis_.cross(Eigen::Vector3d::Unit(smallest)).normalized();
  quarter_ = axis_.cross(zero_);
  fill_buckets();
}

double StereoCandidates::gate(float left_sigma, float right_sigma) const {
  const double sigma = std::sqrt(0.5 * (static_cast<double>(left_sigma) * left_sigma +
                                        static_cast<double>(right_sigma) * right_sigma));
  return options_.epipolar_gate * std::max(sigma, kMinSigma);
}

double StereoCandidates::plane_angle(const Eigen::Vector3d& direction) const {
  return std::atan2(direction.dot(quarter_), direction.dot(zero_)) + std::numbers::pi;
}

// A bucket is as wide as the widest gate, so that a gate touches three buckets at most.
void StereoCandidates::fill_buckets() {
  const double widest =
      options_.epipolar_gate * std::max({kMinSigma, largest_sigma(left_), largest_sigma(right_)});
  double smallest_scale = 1e9;
  for (ObservedRay& ray : right_rays_) {
    const double scale = plane_scale(ray, axis_);
    ray.valid = scale > 0;
    if (ray.valid) smallest_scale = std::min(smallest_scale, scale);
  }
  const double width = std::max(widest / smallest_scale, 1e-4);
  const int buckets = std::max(3, static_cast<int>(2 * std::numbers::pi / width));
  starts_.assign(buckets + 1, 0);
  std::vector<int> bucket_of(right_rays_.size(), -1);
  for (std::size_t i = 0; i < right_rays_.size(); ++i) {
    if (!right_rays_[i].valid) continue;
    const double turn = plane_angle(right_rays_[i].direction) / (2 * std::numbers::pi);
    bucket_of[i] = std::min(static_cast<int>(turn * buckets), buckets - 1);
    ++starts_[bucket_of[i] + 1];
  }
  for (int i = 0; i < buckets; ++i) starts_[i + 1] += starts_[i];
  indices_.resize(starts_.back());
  std::vector<int> next(starts_.begin(), starts_.end() - 1);
  for (std::size_t i = 0; i < right_rays_.size(); ++i) {
    if (bucket_of[i] >= 0) indices_[next[bucket_of[i]]++] = static_cast<int>(i);
  }
}

// Distance d along the left ray u where the right ray s comes closest: t + d u is parallel to s.
bool StereoCandidates::inverse_depth_possible(const Eigen::Vector3d& left_in_right, int right,
                                              double gate) const {
  const Eigen::Vector3d& u = left_in_right;
  const Eigen::Vector3d& s = right_rays_[right].direction;
  const Eigen::Vector3d& t = right_from_left_.translation;
  const Eigen::Vector3d normal = u.cross(s);
  const double along = -t.cross(s).dot(normal);
  const double square = normal.squaredNorm();
  const double slack = gate / pixels_per_depth_;
  // 1 / d = square / along; compared without dividing by zero.
  if (along > 0) return square <= along / options_.min_depth;
  return square <= -along * slack || square < 1e-16;
}

void StereoCandidates::find(int left, std::vector<int>& candidates) const {
  candidates.clear();
  const ObservedRay& ray = left_rays_[left];
  if (!ray.valid) return;
  const Eigen::Vector3d direction = right_from_left_.rotation * ray.direction;
  const Eigen::Vector3d normal = axis_.cross(direction);
  const double sine = normal.norm();
  if (sine < kMinSine) return;
  const int buckets = static_cast<int>(starts_.size()) - 1;
  const double turn = plane_angle(direction) / (2 * std::numbers::pi);
  const int centre = std::min(static_cast<int>(turn * buckets), buckets - 1);
  for (int step = -1; step <= 1; ++step) {
    const int bucket = (centre + step + buckets) % buckets;
    for (int i = starts_[bucket]; i < starts_[bucket + 1]; ++i) {
      const int right = indices_[i];
      const double allowed = gate(left_.sigmas[left], right_.sigmas[right]);
      if (plane_distance(normal / sine, right_rays_[right]) <= allowed &&
          inverse_depth_possible(direction, right, allowed)) {
        candidates.push_back(right);
      }
    }
  }
  std::sort(candidates.begin(), candidates.end());
}

}  // namespace rover
