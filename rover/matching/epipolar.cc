#include "rover/matching/epipolar.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

namespace rover {

std::vector<ObservedRay> observe_rays(const Camera& camera,
                                      std::span<const Eigen::Vector2f> positions) {
  std::vector<ObservedRay> rays(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const auto direction = camera.unproject(positions[i].cast<double>());
    if (!direction) continue;
    rays[i].direction = *direction;
    rays[i].valid = camera.project(*direction, &rays[i].jacobian).has_value();
  }
  return rays;
}

double plane_distance(const Eigen::Vector3d& normal, const ObservedRay& ray) {
  // Moving the ray onto the plane moves its pixel by jacobian * normal * sine; the pixel's distance
  // from the line is the part of it across the line, which runs along jacobian * in_plane.
  const double sine = normal.dot(ray.direction);
  const Eigen::Vector2d offset = ray.jacobian * normal * sine;
  const Eigen::Vector2d along = ray.jacobian * normal.cross(ray.direction);
  const double length = along.norm();
  if (length < 1e-12) return offset.norm();
  return std::abs(offset.x() * along.y() - offset.y() * along.x()) / length;
}

double epipolar_distance(const ObservedRay& a, const ObservedRay& b, const SE3& b_from_a) {
  if (!a.valid || !b.valid) return std::numeric_limits<double>::infinity();
  const Eigen::Matrix3d rotation = b_from_a.rotation_matrix();
  const Eigen::Vector3d in_b = b_from_a.translation.cross(rotation * a.direction);
  const Eigen::Vector3d in_a = rotation.transpose() * b_from_a.translation.cross(b.direction);
  if (in_b.norm() < 1e-12 || in_a.norm() < 1e-12) return 0;
  return std::max(plane_distance(in_b.normalized(), b), plane_distance(in_a.normalized(), a));
}

namespace {

// Where the two rays come closest: whether that is in front of both, or parallax is below a
// thousandth of a radian, so that noise decides the sign.
bool in_front(const Eigen::Vector3d& a_in_b, const Eigen::Vector3d& b, const Eigen::Vector3d& t) {
  const Eigen::Vector3d normal = a_in_b.cross(b);
  if (normal.squaredNorm() < 1e-6) return true;
  return -normal.dot(t.cross(b)) > 0 && -normal.dot(t.cross(a_in_b)) > 0;
}

}  // namespace

std::vector<Match> epipolar_inliers(std::span<const Match> matches, std::span<const ObservedRay> a,
                                    std::span<const ObservedRay> b, const SE3& b_from_a,
                                    double max_distance) {
  std::vector<Match> inliers;
  for (const Match& match : matches) {
    const ObservedRay &ray_a = a[match.a], &ray_b = b[match.b];
    if (epipolar_distance(ray_a, ray_b, b_from_a) <= max_distance &&
        in_front(b_from_a.rotation * ray_a.direction, ray_b.direction, b_from_a.translation)) {
      inliers.push_back(match);
    }
  }
  return inliers;
}

}  // namespace rover
