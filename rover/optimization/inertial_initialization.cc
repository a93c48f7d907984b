#include "rover/optimization/inertial_initialization.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "rover/base/error.h"
#include "rover/optimization/inertial_alignment.h"
#include "rover/optimization/levenberg_marquardt.h"
#include "rover/optimization/robust_kernel.h"

namespace rover {
namespace {

// Where the unknowns are: gravity's direction (2), log scale, bias (6), velocities.
constexpr int kScale = 2;
constexpr int kBias = 3;
constexpr int kVelocities = 9;

class AlignmentModel {
 public:
  using State = AlignmentState;
  using Equations = DenseEquations;
  using Step = DenseStep;

  AlignmentModel(const InitializationProblem& problem, const InitializationOptions& options)
      : problem_(problem),
        kernel_{options.huber},
        bias_prior_(
            bias_prior({}, options.gyroscope_bias_sigma, options.accelerometer_bias_sigma)) {}

  void linearize(const State& state, Equations& equations) const {
    equations.reset(kVelocities + 3 * static_cast<int>(state.velocity.size()));
    for (std::size_t i = 0; i < problem_.motions.size(); ++i) add_motion(state, i, equations);
    const Matrix6d information = bias_prior_.information.bottomRightCorner<6, 6>();
    const Vector6d weighted = information * state.bias.vector();
    equations.cost += 0.5 * weighted.dot(state.bias.vector());
    equations.gradient.segment<6>(kBias) += weighted;
    equations.hessian.block<6, 6>(kBias, kBias) += information;
    if (problem_.metric) equations.hessian(kScale, kScale) = 1;  // nothing else depends on it
  }
  bool solve(const Equations& equations, const Damping& damping, Step& step) const {
    return solve_damped(equations, damping, step);
  }
  void move(const State& from, const Step& step, State& to) const {
    to = from;
    const Eigen::VectorXd& d = step.delta;
    to.world_from_aligned = (from.world_from_aligned * so3_exp({d[0], d[1], 0})).normalized();
    to.log_scale += d[kScale];
    to.bias = ImuBias::from_vector(from.bias.vector() + d.segment<6>(kBias));
    for (std::size_t i = 0; i < to.velocity.size(); ++i)
      to.velocity[i] += d.segment<3>(static_cast<Eigen::Index>(kVelocities + 3 * i));
  }

  // From now on motions that do not fit lose weight.
  void make_robust() { robust_ = true; }

  // What a motion's chi-square counts with.
  double weight(double chi2) const { return robust_ ? kernel_.weight(chi2) : 1; }

  double chi2(const State& state, std::size_t i) const {
    const Vector15d residual = imu_residual(problem_.motions[i], scaled_state(problem_, state, i),
                                            scaled_state(problem_, state, i + 1), state.gravity());
    return residual.head<9>().squaredNorm();
  }

 private:
  void add_motion(const State& state, std::size_t i, Equations& equations) const {
    const InertialState from = scaled_state(problem_, state, i);
    const InertialState to = scaled_state(problem_, state, i + 1);
    ImuJacobians by;
    // One bias for all: how it walks takes no part.
    Vector9d residual = imu_residual(problem_.motions[i], from, to, state.gravity(), &by).head<9>();
    const double chi2 = residual.squaredNorm();
    const double root = std::sqrt(weight(chi2));
    if (robust_) equations.cost += 0.5 * (kernel_.rho(chi2) - root * root * chi2);
    residual *= root;
    Matrix9d by_common;
    const Eigen::Matrix3d turn = state.world_from_aligned.toRotationMatrix();
    by_common.leftCols<2>() =
        (by.by_gravity * turn * -skew(gravity_of_z_up())).topLeftCorner<9, 2>();
    by_common.col(kScale) =
        by_scale(by.by_from, state, from, i) + by_scale(by.by_to, state, to, i + 1);
    by_common.rightCols<6>() = by.by_from.topRightCorner<9, 6>() + by.by_to.topRightCorner<9, 6>();
    Matrix96d by_velocities;
    by_velocities << by.by_from.block<9, 3>(0, 6), by.by_to.block<9, 3>(0, 6);
    by_common *= root;
    by_velocities *= root;
    equations.add(residual, by_common, 0, by_velocities, kVelocities + 3 * static_cast<int>(i));
  }

  Vector9d by_scale(const Matrix15d& by_state, const State& state, const InertialState& body,
                    std::size_t keyframe) const {
    if (problem_.metric) return Vector9d::Zero();
    const Eigen::Vector3d moves =
        std::exp(state.log_scale) * problem_.world_from_camera[keyframe].translation;
    return by_state.topLeftCorner<9, 3>() * (body.world_from_body.rotation.conjugate() * moves);
  }

  const InitializationProblem& problem_;
  HuberKernel kernel_;
  bool robust_ = false;
  StatePrior bias_prior_;
};

void check_problem(const InitializationProblem& problem) {
  if (problem.world_from_camera.size() < 2 ||
      problem.motions.size() + 1 != problem.world_from_camera.size())
    throw std::invalid_argument(
        "inertial initialisation: needs two keyframes or more and one motion between each two");
}

// What there is to learn from.
struct Excitation {
  double duration = 0;
  double rotation = 0;
  double acceleration = 0;
};

Excitation excitation_of(const InitializationProblem& problem) {
  Excitation result;
  const auto& poses = problem.world_from_camera;
  for (const SE3& pose : poses)
    result.rotation = std::max(result.rotation, poses[0].rotation.angularDistance(pose.rotation));
  std::vector<Eigen::Vector3d> forces;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < problem.motions.size(); ++i) {
    const Preintegration& motion = problem.motions[i];
    const SE3 body = poses[i] * problem.body_from_camera.inverse();
    forces.emplace_back(body.rotation * motion.delta().velocity / motion.duration());
    mean += forces.back() / static_cast<double>(problem.motions.size());
    result.duration += motion.duration();
  }
  for (const Eigen::Vector3d& force : forces)
    result.acceleration += (force - mean).squaredNorm() / static_cast<double>(forces.size());
  result.acceleration = std::sqrt(result.acceleration);
  return result;
}

// "rotation and acceleration", or what else is scarce.
std::string needs(const Excitation& there, const InitializationOptions& options) {
  std::vector<std::string> wants;
  if (there.duration < options.min_duration) wants.emplace_back("time");
  if (there.rotation < options.min_rotation) wants.emplace_back("rotation");
  if (there.acceleration < options.min_acceleration) wants.emplace_back("acceleration");
  if (wants.empty()) return "more of this motion";
  std::string text = wants[0];
  for (std::size_t i = 1; i < wants.size(); ++i) text += " and " + wants[i];
  return text;
}

void judge(const Excitation& excitation, const InitializationOptions& options,
           InitializationResult& result) {
  if (result.chi2_ratio > options.max_chi2_ratio) {
    result.missing = fmt::format(
        "camera and inertial sensor contradict each other (chi-square {:.1f} per degree of "
        "freedom): check extrinsics, clocks and noise",
        result.chi2_ratio);
  } else if (result.scale_sigma > options.max_scale_sigma) {
    result.missing = fmt::format("scale is known to {:.0f}% ({:.0f}% needed): needs {}",
                                 100 * result.scale_sigma, 100 * options.max_scale_sigma,
                                 needs(excitation, options));
  } else if (result.gravity_sigma > options.max_gravity_sigma) {
    result.missing = fmt::format("gravity is known to {:.1f} mrad ({:.1f} needed): needs {}",
                                 1e3 * result.gravity_sigma, 1e3 * options.max_gravity_sigma,
                                 needs(excitation, options));
  }
  result.accepted = result.missing.empty();
}

// Standard deviations and chi-squares at the solution; false where it is not determined.
bool add_statistics(const InitializationProblem& problem, const AlignmentModel& model,
                    const AlignmentState& state, const DenseEquations& equations,
                    InitializationResult& result) {
  const Eigen::MatrixXd covariance = inverse_of(equations.hessian.selfadjointView<Eigen::Lower>());
  if (covariance.rows() == 0) return false;
  double sum = 0;
  for (std::size_t i = 0; i < problem.motions.size(); ++i) {
    result.chi2.push_back(model.chi2(state, i));
    sum += model.weight(result.chi2.back()) * result.chi2.back();
  }
  // Each motion gives 9 equations and takes 3 velocities; gravity, scale and first velocity beside.
  const double freedom = 6 * static_cast<double>(problem.motions.size()) - (problem.metric ? 5 : 6);
  result.chi2_ratio = sum / std::max(1.0, freedom);
  const double factor = std::sqrt(std::max(1.0, result.chi2_ratio));
  const Eigen::VectorXd sigma = factor * covariance.diagonal().cwiseSqrt();
  result.gravity_sigma = std::max(sigma[0], sigma[1]);
  result.scale_sigma = problem.metric ? 0 : sigma[kScale];
  result.bias_sigma = sigma.segment<6>(kBias);
  return true;
}

void express_aligned(const InitializationProblem& problem, const AlignmentState& state,
                     InitializationResult& result) {
  const Eigen::Quaterniond turn = world_from_aligned(state.gravity()).conjugate();
  result.aligned_from_world = {std::exp(state.log_scale), turn, Eigen::Vector3d::Zero()};
  for (std::size_t i = 0; i < problem.world_from_camera.size(); ++i) {
    InertialState body = scaled_state(problem, state, i);
    body.world_from_body = SE3(turn, Eigen::Vector3d::Zero()) * body.world_from_body;
    body.velocity = turn * body.velocity;
    result.states.push_back(body);
  }
}

}  // namespace

void InitializationOptions::check() const {
  require(iterations > 0, "inertial initialisation: iterations must be positive, not {}",
          iterations);
  require(gyroscope_bias_sigma > 0 && accelerometer_bias_sigma > 0,
          "inertial initialisation: bias sigmas must be positive, not {} and {}",
          gyroscope_bias_sigma, accelerometer_bias_sigma);
  require(huber > 0, "inertial initialisation: huber must be positive, not {}", huber);
  require(max_scale_sigma > 0 && max_gravity_sigma > 0 && max_chi2_ratio > 0,
          "inertial initialisation: limits must be positive, not {}, {} and {}", max_scale_sigma,
          max_gravity_sigma, max_chi2_ratio);
  require(min_duration >= 0 && min_rotation >= 0 && min_acceleration >= 0,
          "inertial initialisation: least motion must not be negative: {}, {} and {}", min_duration,
          min_rotation, min_acceleration);
}

InitializationResult initialize_inertial(const InitializationProblem& given,
                                         const InitializationOptions& options) {
  options.check();
  check_problem(given);
  InitializationProblem problem = given;
  InitializationResult result;
  const Excitation excitation = excitation_of(problem);
  result.missing =
      "motion does not determine scale and gravity: needs " + needs(excitation, options);
  auto state = linear_alignment(problem);
  if (!state) return result;
  AlignmentModel model(problem, options);
  for (int round = 0; round < 2; ++round) {  // the second robust, and integrated with better biases
    LevenbergMarquardt<AlignmentModel> solver(model, *state);
    if (!solver.run({.iterations = options.iterations, .absolute_decrease = 1e-6}).usable)
      return result;
    state = solver.state();
    for (Preintegration& motion : problem.motions) motion.reintegrate(state->bias);
    model.make_robust();
  }
  DenseEquations equations;
  model.linearize(*state, equations);
  if (!add_statistics(problem, model, *state, equations, result)) return result;
  express_aligned(problem, *state, result);
  result.solved = true;
  result.missing.clear();
  judge(excitation, options, result);
  return result;
}

}  // namespace rover
