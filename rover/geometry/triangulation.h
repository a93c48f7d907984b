#pragma once

#include <optional>
#include <span>

#include "rover/geometry/se3.h"

namespace rover {

// One view of a point: the unit bearing towards it in its camera's frame, and that camera's pose.
struct ViewRay {
  SE3 world_from_camera;
  Eigen::Vector3d bearing;
};

struct TriangulationOptions {
  // Rad. The widest angle between two rays must be larger: the depth of nearly parallel rays is
  // noise. The default is about a quarter of a degree.
  double min_parallax = 0.005;
  // Rad. The triangulated point must be this close to every ray. Infinite: any distance.
  double max_error = 0.02;
  int max_iterations = 5;  // of Gauss-Newton

  // Throws InputError for values that make no sense.
  void check() const;
};

struct Triangulation {
  Eigen::Vector3d point;  // in the world
  double parallax;        // rad, the widest angle between two of the rays
  double max_error;       // rad, the largest angle between a ray and the point
  // Of the point in m^2, for bearings with a deviation of 1 rad on each axis across the ray:
  // multiply by the square of their deviation.
  Eigen::Matrix3d unit_covariance;
};

// The point that two or more rays see: a linear solution, that point from which the rays' squared
// distances (weighted by the inverse of its depth) sum to the least, then Gauss-Newton steps on the
// angles between rays and point. Works for every camera model.
//
// Nothing if there are fewer than two rays; if they are parallel to within min_parallax (pure
// rotation, points at infinity); if all rays lie on one line (the point is on the baseline); if the
// point does not lie in front of every camera, i.e. within 90 degrees of its ray; or if it is
// farther than max_error from a ray.
std::optional<Triangulation> triangulate(std::span<const ViewRay> rays,
                                         const TriangulationOptions& options = {});

// The widest angle between two rays in rad, seen as directions in the world; 0 for fewer than two.
double parallax_angle(std::span<const ViewRay> rays);

}  // namespace rover
