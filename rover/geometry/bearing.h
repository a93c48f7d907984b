#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace rover {

// The angle between two vectors in rad, accurate for small angles, where the dot product is not.
inline double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// Two unit vectors across a unit bearing, as columns.
inline Eigen::Matrix<double, 3, 2> tangent_basis(const Eigen::Vector3d& bearing) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = bearing.unitOrthogonal();
  basis.col(1) = bearing.cross(basis.col(0));
  return basis;
}

}  // namespace rover
