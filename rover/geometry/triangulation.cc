#include "rover/geometry/triangulation.h"

#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "rover/base/error.h"
#include "rover/geometry/bearing.h"

namespace rover {
namespace {

Eigen::Vector3d direction(const ViewRay& ray) {
  return ray.world_from_camera.rotation * ray.bearing;
}

// Normal equations H x = b of the squared distances from the rays, each weighted.
struct Normal {
  Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();

  void add(const ViewRay& ray, double weight) {
    const Eigen::Vector3d d = direction(ray);
    const Eigen::Matrix3d across = weight * (Eigen::Matrix3d::Identity() - d * d.transpose());
    h += across;
    b += across * ray.world_from_camera.translation;
  }
  // Nothing where the rays do not determine a point.
  std::optional<Eigen::Vector3d> solve() const {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(h);
    const Eigen::Vector3d& values = solver.eigenvalues();
    if (!(values[0] > 1e-14 * values[2])) return std::nullopt;
    return solver.eigenvectors() *
           ((solver.eigenvectors().transpose() * b).array() / values.array()).matrix();
  }
};

double depth_along(const ViewRay& ray, const Eigen::Vector3d& point) {
  return direction(ray).dot(point - ray.world_from_camera.translation);
}

bool in_front(std::span<const ViewRay> rays, const Eigen::Vector3d& point) {
  return std::all_of(rays.begin(), rays.end(),
                     [&](const ViewRay& ray) { return depth_along(ray, point) > 0; });
}

// Distances from the rays first plain, then divided by the depths, which makes them angles.
std::optional<Eigen::Vector3d> linear_point(std::span<const ViewRay> rays) {
  Normal plain, weighted;
  for (const ViewRay& ray : rays) plain.add(ray, 1);
  const auto first = plain.solve();
  if (!first || !in_front(rays, *first)) return first;
  for (const ViewRay& ray : rays) {
    const double depth = depth_along(ray, *first);
    weighted.add(ray, 1 / (depth * depth));
  }
  return weighted.solve();
}

// The error of a point at x seen along d is the part of x / |x| across d: the sine of the angle.
struct Angular {
  Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  double cost = 0;
};

Angular angular_equations(std::span<const ViewRay> rays, const Eigen::Vector3d& point) {
  Angular sum;
  for (const ViewRay& ray : rays) {
    const Eigen::Vector3d x = point - ray.world_from_camera.translation, d = direction(ray);
    const double distance = x.norm();
    const Eigen::Vector3d unit = x / distance;
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
    const Eigen::Vector3d error = across * unit;
    const Eigen::Matrix3d jacobian =
        across * (Eigen::Matrix3d::Identity() - unit * unit.transpose()) / distance;
    sum.h += jacobian.transpose() * jacobian;
    sum.gradient += jacobian.transpose() * error;
    sum.cost += error.squaredNorm();
  }
  return sum;
}

// Gauss-Newton steps as long as they help.
Eigen::Vector3d refine(std::span<const ViewRay> rays, Eigen::Vector3d point, int max_iterations) {
  Angular current = angular_equations(rays, point);
  for (int i = 0; i < max_iterations; ++i) {
    const Eigen::Vector3d step = current.h.ldlt().solve(current.gradient);
    const Eigen::Vector3d next = point - step;
    if (!next.allFinite() || !in_front(rays, next)) break;
    const Angular ahead = angular_equations(rays, next);
    if (!(ahead.cost < current.cost)) break;
    point = next;
    current = ahead;
    if (step.norm() < 1e-10 * (point - rays[0].world_from_camera.translation).norm()) break;
  }
  return point;
}

double largest_error(std::span<const ViewRay> rays, const Eigen::Vector3d& point) {
  double largest = 0;
  for (const ViewRay& ray : rays)
    largest =
        std::max(largest, angle_between(direction(ray), point - ray.world_from_camera.translation));
  return largest;
}

}  // namespace

void TriangulationOptions::check() const {
  require(min_parallax >= 0, "triangulation: min_parallax must not be negative");
  require(max_error > 0, "triangulation: max_error must be positive");
  require(max_iterations >= 0, "triangulation: max_iterations must not be negative");
}

double parallax_angle(std::span<const ViewRay> rays) {
  double widest = 0;
  for (std::size_t i = 0; i < rays.size(); ++i)
    for (std::size_t j = i + 1; j < rays.size(); ++j)
      widest = std::max(widest, angle_between(direction(rays[i]), direction(rays[j])));
  return widest;
}

std::optional<Triangulation> triangulate(std::span<const ViewRay> rays,
                                         const TriangulationOptions& options) {
  const double parallax = parallax_angle(rays);
  if (!(parallax > options.min_parallax)) return std::nullopt;
  const auto start = linear_point(rays);
  if (!start || !start->allFinite() || !in_front(rays, *start)) return std::nullopt;
  const Eigen::Vector3d point = refine(rays, *start, options.max_iterations);
  const double error = largest_error(rays, point);
  if (!(error <= options.max_error)) return std::nullopt;
  return Triangulation{point, parallax, error, angular_equations(rays, point).h.inverse()};
}

}  // namespace rover
