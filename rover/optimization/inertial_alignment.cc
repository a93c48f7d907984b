#include "rover/optimization/inertial_alignment.h"

#include <cmath>

#include <Eigen/Cholesky>

namespace rover {
namespace {

Eigen::Quaterniond body_rotation(const InitializationProblem& problem, std::size_t keyframe) {
  return problem.world_from_camera[keyframe].rotation *
         problem.body_from_camera.rotation.conjugate();
}

// Gauss-Newton over the mean rotation error.
ImuBias gyroscope_bias(const InitializationProblem& problem) {
  ImuBias bias;
  for (int iteration = 0; iteration < 4; ++iteration) {
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < problem.motions.size(); ++i) {
      Preintegration motion = problem.motions[i];
      motion.reintegrate(bias);
      const Eigen::Quaterniond turn =
          body_rotation(problem, i).conjugate() * body_rotation(problem, i + 1);
      const Eigen::Vector3d error = so3_log(motion.delta().rotation.conjugate() * turn);
      const Eigen::Matrix3d by_bias = motion.by_bias().block<3, 3>(3, 0);
      hessian += by_bias.transpose() * by_bias;
      gradient += by_bias.transpose() * error;
    }
    bias.gyroscope += hessian.ldlt().solve(gradient);
  }
  return bias;
}

// The linear system over velocities, gravity and scale, in that order.
class LinearSystem {
 public:
  explicit LinearSystem(const InitializationProblem& problem)
      : problem_(problem), gravity_(3 * static_cast<int>(problem.world_from_camera.size())) {
    const int unknowns = gravity_ + 4;
    hessian_ = Eigen::MatrixXd::Zero(unknowns, unknowns);
    right_side_ = Eigen::VectorXd::Zero(unknowns);
    for (std::size_t i = 0; i < problem.motions.size(); ++i) add_motion(i);
  }

  // Velocities, gravity, scale; or an empty vector.
  Eigen::VectorXd solve() {
    const int scale = gravity_ + 3;
    if (problem_.metric) {
      right_side_ -= hessian_.col(scale);
      hessian_.row(scale).setZero();
      hessian_.col(scale).setZero();
      hessian_(scale, scale) = right_side_[scale] = 1;
    }
    const Eigen::VectorXd unit = hessian_.diagonal().cwiseSqrt().cwiseInverse();
    if (!unit.allFinite()) return {};
    const Eigen::LDLT<Eigen::MatrixXd> factors(unit.asDiagonal() * hessian_ * unit.asDiagonal());
    if (!(factors.vectorD().minCoeff() > 1e-14)) return {};
    return unit.asDiagonal() * factors.solve(unit.asDiagonal() * right_side_);
  }

 private:
  // p_j - p_i = v_i t + g t^2 / 2 + R_i dp and v_j = v_i + g t + R_i dv, with p = s c + R t_cb.
  void add_motion(std::size_t i) {
    const Preintegration& motion = problem_.motions[i];
    const double t = motion.duration();
    const int from = 3 * static_cast<int>(i), to = from + 3;
    const Eigen::Quaterniond rotation = body_rotation(problem_, i);
    const auto& a = problem_.world_from_camera[i];
    const auto& b = problem_.world_from_camera[i + 1];
    const Eigen::Vector3d lever = problem_.body_from_camera.inverse().translation;
    const Eigen::Vector3d way = b.rotation * lever - a.rotation * lever;
    const Eigen::Vector3d sigma_p = motion.covariance().diagonal().head<3>().cwiseSqrt();
    const Eigen::Vector3d sigma_v = motion.covariance().diagonal().tail<3>().cwiseSqrt();
    const double wp = 1 / sigma_p.mean(), wv = 1 / sigma_v.mean();
    const Eigen::Vector3d moved = rotation * motion.delta().position;
    const Eigen::Vector3d sped = rotation * motion.delta().velocity;
    const Eigen::Vector3d between = b.translation - a.translation;
    for (int k = 0; k < 3; ++k) {
      Eigen::VectorXd row = Eigen::VectorXd::Zero(right_side_.size());
      row[from + k] = -t;
      row[gravity_ + k] = -0.5 * t * t;
      row[gravity_ + 3] = between[k];
      add_row(wp * row, wp * (moved[k] - way[k]));
      row.setZero();
      row[from + k] = -1;
      row[to + k] = 1;
      row[gravity_ + k] = -t;
      add_row(wv * row, wv * sped[k]);
    }
  }
  void add_row(const Eigen::VectorXd& row, double value) {
    hessian_.noalias() += row * row.transpose();
    right_side_ += value * row;
  }

  const InitializationProblem& problem_;
  int gravity_;
  Eigen::MatrixXd hessian_;
  Eigen::VectorXd right_side_;
};

}  // namespace

Eigen::Quaterniond world_from_aligned(const Eigen::Vector3d& gravity_in_world) {
  return Eigen::Quaterniond::FromTwoVectors(-Eigen::Vector3d::UnitZ(), gravity_in_world);
}

InertialState scaled_state(const InitializationProblem& problem, const AlignmentState& state,
                           std::size_t keyframe) {
  SE3 camera = problem.world_from_camera[keyframe];
  camera.translation *= std::exp(state.log_scale);
  return {camera * problem.body_from_camera.inverse(), state.velocity[keyframe], state.bias};
}

std::optional<AlignmentState> linear_alignment(InitializationProblem& problem) {
  AlignmentState state;
  state.bias = gyroscope_bias(problem);
  for (Preintegration& motion : problem.motions) motion.reintegrate(state.bias);
  const Eigen::VectorXd solution = LinearSystem(problem).solve();
  if (solution.size() == 0 || !solution.allFinite()) return std::nullopt;
  const Eigen::Index velocities = solution.size() - 4;
  const double scale = solution[velocities + 3];
  if (!(scale > 0)) return std::nullopt;
  state.log_scale = std::log(scale);
  state.world_from_aligned = world_from_aligned(solution.segment<3>(velocities));
  for (Eigen::Index i = 0; i < velocities; i += 3)
    state.velocity.emplace_back(solution.segment<3>(i));
  return state;
}

}  // namespace rover
