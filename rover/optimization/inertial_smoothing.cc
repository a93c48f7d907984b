#include "rover/optimization/inertial_smoothing.h"

#include "rover/optimization/levenberg_marquardt.h"

namespace rover {
namespace {

constexpr int kIterations = 10;
constexpr double kNegligibleDecrease = 1e-6;

// One state between what is known of it and its neighbours, which are fixed: the next one, and the
// one before if there is any.
class StepModel {
 public:
  using State = InertialState;
  using Equations = DenseEquations;
  using Step = DenseStep;

  StepModel(const StatePrior& known, const std::optional<KnownNeighbour>& before,
            const KnownNeighbour& after, const Eigen::Vector3d& gravity)
      : known_(known), before_(before), after_(after), gravity_(gravity) {}

  void linearize(const State& state, Equations& equations) const {
    equations.reset(15);
    add_imu_factor(after_.motion, state, after_.state, gravity_, 0, -1, equations);
    if (before_) add_imu_factor(before_->motion, before_->state, state, gravity_, -1, 0, equations);
    add_prior(known_, state, 0, equations);
  }
  bool solve(const Equations& equations, const Damping& damping, Step& step) const {
    return solve_damped(equations, damping, step);
  }
  void move(const State& from, const Step& step, State& to) const {
    to = state_plus(from, step.delta);
  }

 private:
  const StatePrior& known_;
  std::optional<KnownNeighbour> before_;
  KnownNeighbour after_;
  const Eigen::Vector3d& gravity_;
};

std::optional<InertialState> solve(const StepModel& model, const InertialState& start) {
  LevenbergMarquardt<const StepModel> solver(model, start);
  const auto result =
      solver.run({.iterations = kIterations, .absolute_decrease = kNegligibleDecrease});
  if (!result.usable) return std::nullopt;
  return solver.state();
}

}  // namespace

std::vector<InertialState> smooth_reckoning(std::span<const ReckonedStep> steps,
                                            const InertialState& end,
                                            const Eigen::Vector3d& gravity) {
  std::vector<InertialState> states;
  for (const ReckonedStep& step : steps) states.push_back(step.state);
  InertialState next = end;
  for (std::size_t i = steps.size(); i-- > 0;) {
    const StatePrior known{steps[i].state, steps[i].information};
    const auto state = solve(StepModel(known, {}, {next, *steps[i].motion}, gravity), states[i]);
    if (!state) break;
    next = states[i] = *state;
  }
  return states;
}

std::optional<InertialState> state_between(const KnownNeighbour& before,
                                           const KnownNeighbour& after, const StatePrior& known,
                                           const Eigen::Vector3d& gravity) {
  return solve(StepModel(known, before, after, gravity),
               before.motion.predict(before.state, gravity));
}

}  // namespace rover
