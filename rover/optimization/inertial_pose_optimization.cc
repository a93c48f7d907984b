#include "rover/optimization/inertial_pose_optimization.h"

#include <Eigen/Cholesky>

#include "rover/base/error.h"
#include "rover/optimization/levenberg_marquardt.h"
#include "rover/optimization/map_error.h"
#include "rover/optimization/pose_residuals.h"

namespace rover {
namespace {

// A step that lowers half the chi-square by less moves nothing by a tenth of its deviation.
constexpr double kNegligibleDecrease = 5e-3;

// The unknowns: the current state, and the last one behind it unless it is fixed.
class TwoFrameModel {
 public:
  struct State {
    InertialState last, current;
  };
  struct Equations : DenseEquations {
    double imu_chi2 = 0;
    double prior_chi2 = 0;  // of the last state
  };
  using Step = DenseStep;

  TwoFrameModel(const InertialPoseProblem& problem, const PoseResiduals& residuals)
      : problem_(problem), residuals_(residuals) {
    if (!problem.last_information) return;
    prior_.mean = problem.last;
    prior_.information = *problem.last_information;
    last_row_ = 15;
  }

  void linearize(const State& state, Equations& equations) const {
    equations.reset(last_row_ < 0 ? 15 : 30);
    const PoseEquations seen = residuals_.linearize(state.current.world_from_body);
    equations.hessian.topLeftCorner<6, 6>() = seen.hessian;
    equations.gradient.head<6>() = seen.gradient;
    equations.cost = seen.cost;
    equations.imu_chi2 = add_imu_factor(problem_.motion, state.last, state.current,
                                        problem_.gravity, last_row_, 0, equations);
    if (last_row_ >= 0) {
      equations.prior_chi2 = add_prior(prior_, state.last, last_row_, equations);
    }
    if (problem_.current_prior) add_prior(*problem_.current_prior, state.current, 0, equations);
  }
  bool solve(const Equations& equations, const Damping& damping, Step& step) const {
    return solve_damped(equations, damping, step);
  }
  void move(const State& from, const Step& step, State& to) const {
    to.current = state_plus(from.current, step.delta.head<15>());
    to.last = last_row_ < 0 ? from.last : state_plus(from.last, step.delta.tail<15>());
  }

 private:
  const InertialPoseProblem& problem_;
  const PoseResiduals& residuals_;
  StatePrior prior_;
  int last_row_ = -1;
};

// How the unknowns answer to the error of the map: see InertialBundleModel::response. What is seen
// is where the landmarks are, which have answered, too; so has the prior.
Eigen::MatrixXd response_of(const InertialPoseProblem& problem, const InertialState& last,
                            const InertialState& current, const Matrix6d& seen,
                            const DenseEquations& equations) {
  const Eigen::Vector3d& lever = problem.rig.body_from_camera[0].translation;
  const Eigen::Vector3d& here = current.world_from_body.translation;
  const Matrix15x3d by_current = by_map_error(current, lever, here);
  ImuJacobians by;
  imu_residual(problem.motion, last, current, problem.gravity, &by);
  const Matrix15x3d change = by.by_from * by_map_error(last, lever, here) + by.by_to * by_current;
  Eigen::MatrixXd pull = Eigen::MatrixXd::Zero(equations.hessian.rows(), 3);
  pull.topRows<15>() = by.by_to.transpose() * change;
  pull.topRows<6>() -= seen * problem.seen_response;
  if (problem.current_prior) {
    pull.topRows<15>() += problem.current_prior->information * by_current;
  }
  if (problem.last_information) {
    pull.bottomRows<15>() =
        by.by_from.transpose() * change - *problem.last_information * problem.last_response;
  }
  return -equations.hessian.selfadjointView<Eigen::Lower>().llt().solve(pull);
}

// The information of the first 15 unknowns with the others marginalised.
Matrix15d marginal_information(const DenseEquations& equations) {
  const Eigen::MatrixXd full = equations.hessian.selfadjointView<Eigen::Lower>();
  Matrix15d marginal = full.topLeftCorner<15, 15>();
  if (full.rows() > 15) {
    const Matrix15d last = full.bottomRightCorner<15, 15>();
    const Matrix15d cross = full.bottomLeftCorner<15, 15>();
    marginal -= cross.transpose() * last.ldlt().solve(cross);
  }
  return 0.5 * (marginal + marginal.transpose());
}

void finish(const InertialPoseProblem& problem, const TwoFrameModel& model,
            const TwoFrameModel::State& state, const PoseResiduals& residuals,
            InertialPoseEstimate& estimate) {
  TwoFrameModel::Equations equations;
  model.linearize(state, equations);
  estimate.inliers = residuals.selected();
  estimate.inlier_count = residuals.selected_count();
  const PoseEquations seen = residuals.linearize(state.current.world_from_body);
  const double chi2 = seen.chi2;
  estimate.mean_chi2 = estimate.inlier_count > 0 ? chi2 / estimate.inlier_count : 0;
  estimate.imu_chi2 = equations.imu_chi2;
  estimate.prior_chi2 = equations.prior_chi2;
  const Matrix15d information = marginal_information(equations);
  const Eigen::MatrixXd covariance = inverse_of(information);
  if (covariance.rows() == 0) return;
  estimate.last = state.last;
  estimate.current = state.current;
  estimate.information = information;
  estimate.covariance = covariance;
  estimate.response =
      response_of(problem, state.last, state.current, seen.hessian, equations).topRows<15>();
  estimate.converged = true;
}

}  // namespace

void InertialPoseOptions::check() const {
  require(rounds > 0, "inertial pose optimisation: rounds must be positive, not {}", rounds);
  require(iterations > 0, "inertial pose optimisation: iterations must be positive, not {}",
          iterations);
  require(chi2 > 0, "inertial pose optimisation: chi2 must be positive, not {}", chi2);
  require(huber > 0, "inertial pose optimisation: huber must be positive, not {}", huber);
}

InertialPoseEstimate optimize_inertial_pose(const InertialPoseProblem& problem,
                                            const InertialPoseOptions& options) {
  options.check();
  PoseResiduals residuals(problem.rig, problem.observations, options.chi2, options.huber);
  const TwoFrameModel model(problem, residuals);
  TwoFrameModel::State state = {problem.last,
                                problem.motion.predict(problem.last, problem.gravity)};
  InertialPoseEstimate estimate;
  estimate.last = state.last;
  estimate.current = state.current;
  bool usable = true;
  for (int round = 0; round < options.rounds && usable; ++round) {
    LevenbergMarquardt<const TwoFrameModel> solver(model, state);
    usable =
        solver.run({.iterations = options.iterations, .absolute_decrease = kNegligibleDecrease})
            .usable;
    state = solver.state();
    if (!residuals.select(state.current.world_from_body)) break;
  }
  if (usable) finish(problem, model, state, residuals, estimate);
  return estimate;
}

}  // namespace rover
