#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "rover/optimization/damping.h"

namespace rover {

struct MinimizationLimits {
  int iterations = 0;
  double relative_decrease = 0;  // of the cost in one iteration: below, the minimisation ends;
  double absolute_decrease = 0;  // likewise; either is enough
  std::function<bool()> should_stop{};  // asked after each iteration; empty: never
};

struct MinimizationResult {
  int iterations = 0;
  bool usable = false;   // false: the cost was not finite; the state is as given
  bool stopped = false;  // by should_stop
};

// The method of Levenberg and Marquardt. A Model has the types State, Equations (with a member
// `cost`) and Step (with `predicted_decrease`), and the functions
//   void linearize(const State&, Equations&);
//   bool solve(const Equations&, const Damping&, Step&);  // false: damp more
//   void move(const State& from, const Step&, State& to);
// Each candidate is linearised at once: most steps are taken, and then nothing is computed twice.
template <class Model>
class LevenbergMarquardt {
 public:
  LevenbergMarquardt(Model& model, typename Model::State state)
      : model_(model), state_(std::move(state)) {}

  MinimizationResult run(const MinimizationLimits& limits) {
    MinimizationResult result;
    model_.linearize(state_, current_);
    result.usable = std::isfinite(current_.cost);
    while (result.usable && result.iterations < limits.iterations && !damping_.exhausted()) {
      ++result.iterations;
      const bool converged = iterate(limits);
      result.stopped = limits.should_stop && limits.should_stop();
      if (converged || result.stopped) break;
    }
    return result;
  }

  const typename Model::State& state() const { return state_; }
  const typename Model::Equations& equations() const { return current_; }  // at state()

 private:
  // One step, taken or refused; whether no further one is worth while.
  bool iterate(const MinimizationLimits& limits) {
    if (!model_.solve(current_, damping_, step_)) {
      damping_.reject();
      return false;
    }
    model_.move(state_, step_, candidate_);
    model_.linearize(candidate_, next_);
    const double decrease = current_.cost - next_.cost;
    const double negligible =
        std::max(limits.relative_decrease * current_.cost, limits.absolute_decrease);
    if (!(decrease >= 0)) {
      damping_.reject();
      return step_.predicted_decrease <= negligible;
    }
    damping_.accept(decrease / std::max(step_.predicted_decrease, 1e-300));
    std::swap(state_, candidate_);
    std::swap(current_, next_);
    return decrease <= negligible;
  }

  Model& model_;
  Damping damping_;
  typename Model::State state_, candidate_;
  typename Model::Equations current_, next_;
  typename Model::Step step_;
};

}  // namespace rover
