#include "rover/optimization/inertial_smoothing.h"

#include "rover/optimization/levenberg_marquardt.h"

namespace rover {
namespace {

constexpr int kIterations = 10;
constexpr double kNegligibleDecrease = 1e-6;

// One state between what was known of it and the next state, which is fixed.
class StepModel {
 public:
  using State = InertialState;
  using Equations = DenseEquations;
  using Step = DenseStep;

  StepModel(const ReckonedStep& step, const InertialState& next, const Eigen::Vector3d& gravity)
      : step_(step), next_(next), gravity_(gravity), prior_{step.state, step.information} {}

  void linearize(const State& state, Equations& equations) const {
    equations.reset(15);
    add_imu_factor(*step_.motion, state, next_, gravity_, 0, -1, equations);
    add_prior(prior_, state, 0, equations);
  }
  bool solve(const Equations& equations, const Damping& damping, Step& step) const {
    return solve_damped(equations, damping, step);
  }
  void move(const State& from, const Step& step, State& to) const {
    to = state_plus(from, step.delta);
  }

 private:
  const ReckonedStep& step_;
  const InertialState& next_;
  const Eigen::Vector3d& gravity_;
  StatePrior prior_;
};

}  // namespace

std::vector<InertialState> smooth_reckoning(std::span<const ReckonedStep> steps,
                                            const InertialState& end,
                                            const Eigen::Vector3d& gravity) {
  std::vector<InertialState> states;
  for (const ReckonedStep& step : steps) states.push_back(step.state);
  InertialState next = end;
  for (std::size_t i = steps.size(); i-- > 0;) {
    const StepModel model(steps[i], next, gravity);
    LevenbergMarquardt<const StepModel> solver(model, states[i]);
    const auto result =
        solver.run({.iterations = kIterations, .absolute_decrease = kNegligibleDecrease});
    if (!result.usable) break;
    next = states[i] = solver.state();
  }
  return states;
}

}  // namespace rover
