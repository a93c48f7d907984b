#include "rover/simulation/spline_jacobians.h"

namespace rover {
namespace {

using Matrices = std::array<Eigen::Matrix3d, kSplineOrder>;

// From derivatives by the rotation increments, entries 1 to 5, to those by the control points that
// each lies between: increment = log(before^-1 after).
Matrices by_control_points(const Matrices& by_increments, const SplineMotion& motion, int first) {
  Matrices jacobians;
  jacobians.fill(Eigen::Matrix3d::Zero());
  for (int j = 1; j < kSplineOrder; ++j) {
    const Eigen::Vector3d& increment = motion.rotation_increment(first + j);
    const Eigen::Matrix3d inverse = so3_right_jacobian_inverse(increment);
    jacobians[j] += by_increments[j] * inverse;
    jacobians[j - 1] -= by_increments[j] * inverse.transpose();
  }
  return jacobians;
}

}  // namespace

// Sommer et al. (2020), section 5, for SO(3): the recursion for angular velocity is differentiated
// step by step, and each derivative turned into the frames of the steps that follow.
SplineJacobians SplineJacobians::at(const SplineMotion& motion, double seconds) {
  const auto [first, u] = motion.place_of(seconds);
  const SplineBasis basis = SplineBasis::at(u, motion.knot_interval()).cumulative();
  Matrices orientation, velocity;
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();
  Eigen::Matrix3d last_from_first = Eigen::Matrix3d::Identity();
  for (int j = 1; j < kSplineOrder; ++j) {
    const Eigen::Vector3d& increment = motion.rotation_increment(first + j);
    const Eigen::Vector3d turn = basis.value[j] * increment;
    const Eigen::Matrix3d back = so3_exp(turn).conjugate().toRotationMatrix();
    for (int k = 1; k < j; ++k) {
      orientation[k] = back * orientation[k];
      velocity[k] = back * velocity[k];
    }
    omega = back * omega;
    orientation[j] = basis.value[j] * so3_right_jacobian(turn);
    velocity[j] = basis.first[j] * Eigen::Matrix3d::Identity() + skew(omega) * orientation[j];
    omega += basis.first[j] * increment;
    last_from_first = back * last_from_first;
  }
  SplineJacobians jacobians = {by_control_points(orientation, motion, first),
                               by_control_points(velocity, motion, first)};
  jacobians.orientation[0] += last_from_first;
  return jacobians;
}

}  // namespace rover
