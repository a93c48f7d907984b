#include "rover/optimization/imu_factor.h"

namespace rover {
namespace {

// Jacobians of the residual before whitening; the rows of the bias are those of the identity.
void fill_jacobians(const Preintegration& motion, const InertialState& from,
                    const InertialState& to, const Vector9d& residual, const Eigen::Vector3d& moved,
                    const Eigen::Vector3d& sped, ImuJacobians& jacobians) {
  const double t = motion.duration();
  const Eigen::Matrix3d body_from_world = from.world_from_body.rotation_matrix().transpose();
  const Eigen::Matrix3d turn = body_from_world * to.world_from_body.rotation_matrix();
  const Eigen::Vector3d angle = residual.segment<3>(3);
  const Eigen::Matrix3d by_angle = so3_right_jacobian_inverse(angle);
  const Matrix96d& by_bias = motion.by_bias();
  const Vector6d bias_change = from.bias.vector() - motion.bias().vector();

  Matrix15d& by_from = jacobians.by_from;
  by_from.setZero();
  by_from.block<3, 3>(0, 0) = -Eigen::Matrix3d::Identity();
  by_from.block<3, 3>(0, 3) = skew(moved);
  by_from.block<3, 3>(0, 6) = -t * body_from_world;
  by_from.block<3, 3>(3, 3) = -by_angle * turn.transpose();
  by_from.block<3, 3>(6, 3) = skew(sped);
  by_from.block<3, 3>(6, 6) = -body_from_world;
  by_from.block<9, 6>(0, 9) = -by_bias;
  by_from.block<3, 6>(3, 9) = -by_angle * so3_exp(angle).toRotationMatrix().transpose() *
                              so3_right_jacobian(by_bias.middleRows<3>(3) * bias_change) *
                              by_bias.middleRows<3>(3);
  by_from.block<6, 6>(9, 9) = -Matrix6d::Identity();

  Matrix15d& by_to = jacobians.by_to;
  by_to.setZero();
  by_to.block<3, 3>(0, 0) = turn;
  by_to.block<3, 3>(3, 3) = by_angle;
  by_to.block<3, 3>(6, 6) = body_from_world;
  by_to.block<6, 6>(9, 9) = Matrix6d::Identity();

  jacobians.by_gravity.setZero();
  jacobians.by_gravity.topRows<3>() = -0.5 * t * t * body_from_world;
  jacobians.by_gravity.middleRows<3>(6) = -t * body_from_world;
}

StatePrior diagonal_prior(const InertialState& mean, int first, const Vector6d& sigma, int count) {
  StatePrior prior;
  prior.mean = mean;
  for (int i = 0; i < count; ++i)
    prior.information(first + i, first + i) = 1 / (sigma[i] * sigma[i]);
  return prior;
}

Vector6d two_sigmas(double first, double second) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(first), Eigen::Vector3d::Constant(second);
  return sigma;
}

Matrix15d jacobian_of_minus(const InertialState& state, const StatePrior& prior,
                            const Vector15d& difference) {
  const Eigen::Quaterniond turn =
      prior.mean.world_from_body.rotation.conjugate() * state.world_from_body.rotation;
  Matrix15d jacobian = Matrix15d::Identity();
  jacobian.block<3, 3>(0, 0) = turn.toRotationMatrix();
  jacobian.block<3, 3>(3, 3) = so3_right_jacobian_inverse(difference.segment<3>(3));
  return jacobian;
}

}  // namespace

Vector15d imu_residual(const Preintegration& motion, const InertialState& from,
                       const InertialState& to, const Eigen::Vector3d& gravity,
                       ImuJacobians* jacobians) {
  const double t = motion.duration();
  const InertialDelta delta = motion.corrected(from.bias);
  const Eigen::Quaterniond body_from_world = from.world_from_body.rotation.conjugate();
  const Eigen::Vector3d moved =
      body_from_world * (to.world_from_body.translation - from.world_from_body.translation -
                         t * from.velocity - 0.5 * t * t * gravity);
  const Eigen::Vector3d sped = body_from_world * (to.velocity - from.velocity - t * gravity);
  const Eigen::Quaterniond turned = body_from_world * to.world_from_body.rotation;

  Vector15d residual;
  residual << moved - delta.position, so3_log(delta.rotation.conjugate() * turned),
      sped - delta.velocity, to.bias.vector() - from.bias.vector();
  const auto whitening = motion.whitening().triangularView<Eigen::Lower>();
  if (jacobians) {
    fill_jacobians(motion, from, to, residual.head<9>(), moved, sped, *jacobians);
    jacobians->by_from = (whitening * jacobians->by_from).eval();
    jacobians->by_to = (whitening * jacobians->by_to).eval();
    jacobians->by_gravity = (whitening * jacobians->by_gravity).eval();
  }
  return whitening * residual;
}

double add_imu_factor(const Preintegration& motion, const InertialState& from,
                      const InertialState& to, const Eigen::Vector3d& gravity, int from_row,
                      int to_row, DenseEquations& equations) {
  ImuJacobians jacobians;
  const Vector15d residual = imu_residual(motion, from, to, gravity, &jacobians);
  equations.add(residual, jacobians.by_from, from_row, jacobians.by_to, to_row);
  return residual.head<9>().squaredNorm();
}

Vector15d prior_difference(const StatePrior& prior, const InertialState& state,
                           Matrix15d* by_state) {
  Vector15d difference = state_minus(state, prior.mean);
  if (by_state) *by_state = jacobian_of_minus(state, prior, difference);
  return difference;
}

double add_prior(const StatePrior& prior, const InertialState& state, int row,
                 DenseEquations& equations) {
  Matrix15d jacobian;
  const Vector15d difference = prior_difference(prior, state, &jacobian);
  const Vector15d weighted = prior.information * difference;
  const double chi2 = difference.dot(weighted);
  equations.cost += 0.5 * chi2;
  if (row < 0) return chi2;
  equations.gradient.segment<15>(row) += jacobian.transpose() * weighted;
  equations.hessian.block<15, 15>(row, row) += jacobian.transpose() * prior.information * jacobian;
  return chi2;
}

StatePrior pose_prior(const SE3& world_from_body, double translation_sigma, double rotation_sigma) {
  InertialState mean;
  mean.world_from_body = world_from_body;
  return diagonal_prior(mean, 0, two_sigmas(translation_sigma, rotation_sigma), 6);
}

StatePrior velocity_prior(const Eigen::Vector3d& velocity, double sigma) {
  InertialState mean;
  mean.velocity = velocity;
  return diagonal_prior(mean, 6, two_sigmas(sigma, sigma), 3);
}

StatePrior bias_prior(const ImuBias& bias, double gyroscope_sigma, double accelerometer_sigma) {
  InertialState mean;
  mean.bias = bias;
  return diagonal_prior(mean, 9, two_sigmas(gyroscope_sigma, accelerometer_sigma), 6);
}

}  // namespace rover
