#include "rover/optimization/schur_solver.h"

#include "rover/optimization/bundle_equations.h"
#include "rover/optimization/schur_complement.h"

namespace rover {
namespace {

// A bundle adjustment, as LevenbergMarquardt wants it.
class BundleModel {
 public:
  using State = BundleState;
  using Equations = BundleEquations;
  using Step = BundleStep;

  BundleModel(const BundleProblem& problem, const BundlePass& pass)
      : gauge_(pass.gauge),
        structure_(problem, pass.active),
        linearizer_(problem, structure_, pass),
        complement_(structure_) {}

  void linearize(const State& state, Equations& equations) const {
    linearizer_.linearize(state, equations);
  }
  bool solve(const Equations& equations, const Damping& damping, Step& step) {
    return complement_.solve(equations, nullptr, damping, step);
  }
  void move(const State& from, const Step& step, State& to) const {
    to = from;
    for (std::size_t s = 0; s < structure_.free_poses.size(); ++s) {
      const int pose = structure_.free_poses[s];
      SE3& moved = to.world_from_body[pose];
      moved = se3_plus(moved, step.states.segment<6>(static_cast<Eigen::Index>(6 * s)));
      if (pose == gauge_.pose) moved = gauge_.restored(moved);
    }
    for (std::size_t t = 0; t < step.points.size(); ++t)
      to.points[structure_.tracks[t].point] += step.points[t];
  }

 private:
  const ScaleGauge& gauge_;
  BundleStructure structure_;
  BundleLinearizer linearizer_;
  SchurComplement complement_;
};

}  // namespace

MinimizationResult minimize_with_schur(BundleProblem& problem, const BundlePass& pass) {
  BundleModel model(problem, pass);
  LevenbergMarquardt<BundleModel> solver(model, {problem.world_from_body, problem.points});
  const MinimizationResult result = solver.run(pass.limits());
  problem.world_from_body = solver.state().world_from_body;
  problem.points = solver.state().points;
  return result;
}

}  // namespace rover
