#include "rover/optimization/calibration_model.h"

#include <cmath>
#include <utility>

namespace rover {
namespace {

using Matrix15x6d = Eigen::Matrix<double, 15, 6>;
using Matrix9x15d = Eigen::Matrix<double, 9, 15>;
using Matrix9x18d = Eigen::Matrix<double, 9, 18>;

// The factor's Jacobians by the unknowns, of one of the two keyframes.
struct EndJacobians {
  Eigen::Matrix<double, 9, 1> by_offset;
  Eigen::Matrix<double, 9, 6> by_camera;
  Eigen::Matrix<double, 9, 3> by_velocity;
  Eigen::Matrix<double, 9, 6> by_bias;
};

EndJacobians chain(const Matrix15d& factor, const Matrix15d& by_state, const Vector15d& by_time,
                   const Matrix6d& by_camera) {
  const Eigen::Matrix<double, 9, 15> whole = (factor * by_state).topRows<9>();
  EndJacobians end;
  end.by_offset = -(factor * by_time).head<9>();
  end.by_camera = whole.leftCols<6>() * by_camera;
  end.by_velocity = whole.middleCols<3>(6);
  end.by_bias = whole.rightCols<6>();
  return end;
}

// 0.5 |d|^2 of a vector with a standard deviation for each element.
template <class Difference, class Sigma>
void add_diagonal(const Difference& difference, const Sigma& sigma, int row,
                  DenseEquations& equations) {
  for (Eigen::Index i = 0; i < difference.size(); ++i) {
    const double information = 1 / (sigma[i] * sigma[i]);
    equations.cost += 0.5 * information * difference[i] * difference[i];
    equations.gradient[row + i] += information * difference[i];
    equations.hessian(row + i, row + i) += information;
  }
}

Vector6d two_sigmas(double first, double second) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(first), Eigen::Vector3d::Constant(second);
  return sigma;
}

}  // namespace

InertialState CalibrationState::body(std::size_t keyframe) const {
  return {world_from_camera[keyframe] * body_from_camera.inverse(), velocity[keyframe], bias};
}

Matrix6d body_by_camera(const SE3& body_from_camera) {
  const Eigen::Matrix3d turn = body_from_camera.rotation_matrix();
  Matrix6d jacobian;
  jacobian << turn, skew(body_from_camera.translation) * turn, Eigen::Matrix3d::Zero(), turn;
  return jacobian;
}

InertialState carried(const InertialState& state, const Reading& reading, double time,
                      Matrix15d* by_state, Vector15d* by_time) {
  InertialState to = state;
  const Eigen::Quaterniond turn = so3_exp(time * reading.angular_velocity);
  to.world_from_body.translation +=
      time * state.velocity + 0.5 * time * time * reading.acceleration;
  to.world_from_body.rotation = (state.world_from_body.rotation * turn).normalized();
  to.velocity += time * reading.acceleration;
  const Eigen::Matrix3d end_from_world = to.world_from_body.rotation_matrix().transpose();
  if (by_state) {
    by_state->setIdentity();
    by_state->block<3, 3>(0, 0) = by_state->block<3, 3>(3, 3) = turn.toRotationMatrix().transpose();
    by_state->block<3, 3>(0, 6) = time * end_from_world;
  }
  if (by_time) {
    by_time->setZero();
    by_time->head<3>() = end_from_world * (state.velocity + time * reading.acceleration);
    by_time->segment<3>(3) = reading.angular_velocity;
    by_time->segment<3>(6) = reading.acceleration;
  }
  return to;
}

CalibrationModel::CalibrationModel(const CalibrationProblem& problem,
                                   const CalibrationOptions& options,
                                   std::vector<Preintegration> motions,
                                   std::vector<Reading> readings, double cut_offset)
    : problem_(problem),
      options_(options),
      motions_(std::move(motions)),
      readings_(std::move(readings)),
      cut_offset_(cut_offset),
      kernel_{options.huber},
      offset_free_(options.time_offset),
      extrinsics_free_(options.extrinsics) {}

void CalibrationModel::linearize(const State& state, Equations& equations) const {
  equations.reset(kStates + kStride * static_cast<int>(state.velocity.size()));
  for (std::size_t i = 0; i < motions_.size(); ++i) add_motion(state, i, equations);
  add_vision(state, equations);
  add_priors(state, equations);
  hold(kStates, 6, equations);  // the first camera's pose: position and direction of the world
  if (!offset_free_) hold(kOffset, 1, equations);
  if (!extrinsics_free_) hold(kExtrinsics, 6, equations);
}

void CalibrationModel::add_motion(const State& state, std::size_t i, Equations& equations) const {
  Matrix15d from_by_state, to_by_state;
  Vector15d from_by_time, to_by_time;
  const double earlier = -state.time_offset;
  const InertialState from =
      carried(state.body(i), readings_[i], earlier, &from_by_state, &from_by_time);
  const InertialState to =
      carried(state.body(i + 1), readings_[i + 1], earlier, &to_by_state, &to_by_time);
  ImuJacobians by;
  Vector9d residual = imu_residual(motions_[i], from, to, state.gravity(), &by).head<9>();
  const Matrix6d by_camera = body_by_camera(state.body_from_camera);
  const EndJacobians a = chain(by.by_from, from_by_state, from_by_time, by_camera);
  const EndJacobians b = chain(by.by_to, to_by_state, to_by_time, by_camera);
  const Eigen::Matrix3d turn = state.world_from_aligned.toRotationMatrix();
  Matrix9x15d by_common;
  by_common.col(kOffset) = a.by_offset + b.by_offset;
  by_common.middleCols<6>(kExtrinsics) = -a.by_camera - b.by_camera;
  by_common.middleCols<2>(kGravity) =
      (by.by_gravity * turn * -skew(gravity_of_z_up())).topLeftCorner<9, 2>();
  by_common.middleCols<6>(kBias) = a.by_bias + b.by_bias;
  Matrix9x18d by_states;
  by_states << a.by_camera, a.by_velocity, b.by_camera, b.by_velocity;
  const double chi2 = residual.squaredNorm();
  const double root = std::sqrt(weight(chi2));
  if (robust_) equations.cost += 0.5 * (kernel_.rho(chi2) - root * root * chi2);
  residual *= root;
  by_common *= root;
  by_states *= root;
  equations.add(residual, by_common, 0, by_states, kStates + kStride * static_cast<int>(i));
}

// Poses stay so close to those of vision that their differences' Jacobian is the identity. The
// information's blocks go where the poses' unknowns are, a velocity between each two.
void CalibrationModel::add_vision(const State& state, Equations& equations) const {
  const auto poses = static_cast<Eigen::Index>(state.world_from_camera.size()) - 1;
  Eigen::VectorXd difference(6 * poses);
  for (Eigen::Index i = 0; i < poses; ++i) {
    const auto k = static_cast<std::size_t>(i + 1);
    difference.segment<6>(6 * i) =
        se3_minus(state.world_from_camera[k], problem_.world_from_camera[k]);
  }
  const Eigen::VectorXd weighted = problem_.information * difference;
  equations.cost += 0.5 * difference.dot(weighted);
  for (Eigen::Index i = 0; i < poses; ++i) {
    const Eigen::Index row = kStates + kStride * (i + 1);
    equations.gradient.segment<6>(row) += weighted.segment<6>(6 * i);
    for (Eigen::Index j = 0; j <= i; ++j) {
      equations.hessian.block<6, 6>(row, kStates + kStride * (j + 1)) +=
          problem_.information.block<6, 6>(6 * i, 6 * j);
    }
  }
}

void CalibrationModel::add_priors(const State& state, Equations& equations) const {
  add_diagonal(state.bias.vector(),
               two_sigmas(options_.gyroscope_bias_sigma, options_.accelerometer_bias_sigma), kBias,
               equations);
  const double offset = cut_offset_ + state.time_offset - problem_.given.time_offset;
  add_diagonal(Eigen::Matrix<double, 1, 1>(offset),
               Eigen::Matrix<double, 1, 1>(options_.prior_time_offset), kOffset, equations);
  add_diagonal(se3_minus(state.body_from_camera, problem_.given.body_from_camera),
               two_sigmas(options_.prior_translation, options_.prior_rotation), kExtrinsics,
               equations);
}

void CalibrationModel::hold(int first, int count, Equations& equations) const {
  for (int row = first; row < first + count; ++row) {
    equations.hessian.row(row).setZero();
    equations.hessian.col(row).setZero();
    equations.hessian(row, row) = 1;
    equations.gradient[row] = 0;
  }
}

void CalibrationModel::move(const State& from, const Step& step, State& to) const {
  to = from;
  const Eigen::VectorXd& d = step.delta;
  to.time_offset += d[kOffset];
  to.body_from_camera = se3_plus(from.body_from_camera, d.segment<6>(kExtrinsics));
  to.world_from_aligned =
      (from.world_from_aligned * so3_exp({d[kGravity], d[kGravity + 1], 0})).normalized();
  to.bias = ImuBias::from_vector(from.bias.vector() + d.segment<6>(kBias));
  for (std::size_t i = 0; i < to.velocity.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(kStates + kStride * i);
    to.world_from_camera[i] = se3_plus(from.world_from_camera[i], d.segment<6>(row));
    to.velocity[i] += d.segment<3>(row + 6);
  }
}

double CalibrationModel::chi2(const State& state, std::size_t i) const {
  const double earlier = -state.time_offset;
  return imu_residual(motions_[i], carried(state.body(i), readings_[i], earlier),
                      carried(state.body(i + 1), readings_[i + 1], earlier), state.gravity())
      .head<9>()
      .squaredNorm();
}

}  // namespace rover
