#include "rover/optimization/schur_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>

#include "rover/optimization/bundle_equations.h"
#include "rover/optimization/damping.h"

namespace rover {
namespace {

struct BundleStep {
  std::vector<Vector6d> poses;          // per slot
  std::vector<Eigen::Vector3d> points;  // per track
  double predicted_decrease = 0;
};

// Solves damped normal equations by elimination of the points.
class SchurComplement {
 public:
  explicit SchurComplement(const BundleStructure& structure)
      : structure_(structure),
        reduced_(6 * structure.free_poses.size(), 6 * structure.free_poses.size()),
        right_side_(6 * structure.free_poses.size()),
        factors_(structure.tracks.size()),
        whitened_(structure.longest_track) {}

  // False where the damped system is not positive definite to rounding: damp more.
  bool solve(const BundleEquations& equations, const Damping& damping, BundleStep& step) {
    start(equations, damping);
    for (std::size_t t = 0; t < structure_.tracks.size(); ++t) {
      if (!eliminate(t, equations, damping)) return false;
    }
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(reduced_);
    if (cholesky.info() != Eigen::Success) return false;
    cholesky.solveInPlace(right_side_);
    if (!right_side_.allFinite()) return false;
    substitute_back(equations, damping, step);
    return true;
  }

 private:
  using Factor = Eigen::LLT<Eigen::Matrix3d>;

  void start(const BundleEquations& equations, const Damping& damping) {
    reduced_.setZero();
    for (std::size_t s = 0; s < structure_.free_poses.size(); ++s) {
      auto block = reduced_.block<6, 6>(6 * s, 6 * s);
      block = equations.pose_hessian[s];
      for (int i = 0; i < 6; ++i) block(i, i) += damping.of(block(i, i));
      right_side_.segment<6>(6 * s) = -equations.pose_gradient[s];
    }
  }

  // Subtracts W H^-1 W^T of one point with H = L L^T, as the products of Y = W L^-T: symmetric and
  // positive by construction. Edges come in the order of slots, so only the lower half is written.
  bool eliminate(std::size_t track_index, const BundleEquations& equations,
                 const Damping& damping) {
    Eigen::Matrix3d hessian = equations.point_hessian[track_index];
    for (int i = 0; i < 3; ++i) hessian(i, i) += damping.of(hessian(i, i));
    Factor& factor = factors_[track_index];
    factor.compute(hessian);
    if (factor.info() != Eigen::Success) return false;
    const Eigen::Vector3d z = factor.matrixL().solve(equations.point_gradient[track_index]);
    const Eigen::Matrix3d inverse = factor.matrixL().solve(Eigen::Matrix3d::Identity());
    const BundleTrack& track = structure_.tracks[track_index];
    for (int e = track.begin; e < track.end; ++e) {
      const int row = structure_.edges[e].slot;
      if (row < 0) continue;
      Matrix63d& y = whitened_[e - track.begin];
      y.noalias() = equations.cross[e].lazyProduct(inverse.transpose());
      right_side_.segment<6>(6 * row).noalias() += y * z;
      subtract_products(track, e, y);
    }
    return true;
  }

  void subtract_products(const BundleTrack& track, int edge, const Matrix63d& y) {
    const int row = structure_.edges[edge].slot;
    for (int other = track.begin; other <= edge; ++other) {
      const int column = structure_.edges[other].slot;
      if (column < 0) continue;
      reduced_.block<6, 6>(6 * row, 6 * column).noalias() -=
          y.lazyProduct(whitened_[other - track.begin].transpose());
    }
  }

  void substitute_back(const BundleEquations& equations, const Damping& damping,
                       BundleStep& step) const {
    step.predicted_decrease = 0;
    step.poses.resize(structure_.free_poses.size());
    for (std::size_t s = 0; s < step.poses.size(); ++s) {
      step.poses[s] = right_side_.segment<6>(6 * s);
      step.predicted_decrease +=
          decrease(equations.pose_hessian[s], equations.pose_gradient[s], step.poses[s], damping);
    }
    step.points.resize(structure_.tracks.size());
    for (std::size_t t = 0; t < step.points.size(); ++t) {
      step.points[t] = point_step(t, equations, step);
      step.predicted_decrease += decrease(equations.point_hessian[t], equations.point_gradient[t],
                                          step.points[t], damping);
    }
  }

  Eigen::Vector3d point_step(std::size_t track_index, const BundleEquations& equations,
                             const BundleStep& step) const {
    Eigen::Vector3d right_side = -equations.point_gradient[track_index];
    const BundleTrack& track = structure_.tracks[track_index];
    for (int e = track.begin; e < track.end; ++e) {
      const int slot = structure_.edges[e].slot;
      if (slot >= 0) right_side.noalias() -= equations.cross[e].transpose() * step.poses[slot];
    }
    return factors_[track_index].solve(right_side);
  }

  // What a block adds to the predicted decrease: 0.5 d^T (D d - g), from (H + D) d = -g.
  template <class Hessian, class Vector>
  static double decrease(const Hessian& hessian, const Vector& gradient, const Vector& delta,
                         const Damping& damping) {
    double sum = 0;
    for (int i = 0; i < delta.size(); ++i)
      sum += delta[i] * (damping.of(hessian(i, i)) * delta[i] - gradient[i]);
    return 0.5 * sum;
  }

  const BundleStructure& structure_;
  Eigen::MatrixXd reduced_;  // lower half
  Eigen::VectorXd right_side_;
  std::vector<Factor> factors_;      // per track
  std::vector<Matrix63d> whitened_;  // of the track being eliminated
};

class SchurSolver {
 public:
  SchurSolver(BundleProblem& problem, const BundlePass& pass)
      : problem_(problem),
        pass_(pass),
        structure_(problem, pass.active),
        linearizer_(problem, structure_, pass),
        complement_(structure_),
        state_{problem.world_from_body, problem.points} {}

  BundlePassResult run() {
    BundlePassResult result;
    linearizer_.linearize(state_, current_);
    result.usable = std::isfinite(current_.cost);
    while (result.usable && result.iterations < pass_.max_iterations && !damping_.exhausted()) {
      ++result.iterations;
      const bool converged = iterate();
      result.stopped = pass_.options.should_stop && pass_.options.should_stop();
      if (converged || result.stopped) break;
    }
    problem_.world_from_body = state_.world_from_body;
    problem_.points = state_.points;
    return result;
  }

 private:
  // One step, taken or refused; whether no further one is worth while. The candidate is linearised
  // at once: most steps are taken, and then nothing is computed twice.
  bool iterate() {
    if (!complement_.solve(current_, damping_, step_)) {
      damping_.reject();
      return false;
    }
    apply_step();
    linearizer_.linearize(candidate_, next_);
    const double decrease = current_.cost - next_.cost;
    const double negligible = pass_.options.min_relative_decrease * current_.cost;
    if (!(decrease >= 0)) {
      damping_.reject();
      return step_.predicted_decrease <= negligible;
    }
    damping_.accept(decrease / std::max(step_.predicted_decrease, 1e-300));
    std::swap(state_, candidate_);
    std::swap(current_, next_);
    return decrease <= negligible;
  }

  void apply_step() {
    candidate_ = state_;
    for (std::size_t s = 0; s < step_.poses.size(); ++s) {
      const int pose = structure_.free_poses[s];
      SE3& moved = candidate_.world_from_body[pose];
      moved = se3_plus(moved, step_.poses[s]);
      if (pose == pass_.gauge.pose) moved = pass_.gauge.restored(moved);
    }
    for (std::size_t t = 0; t < step_.points.size(); ++t)
      candidate_.points[structure_.tracks[t].point] += step_.points[t];
  }

  BundleProblem& problem_;
  const BundlePass& pass_;
  BundleStructure structure_;
  BundleLinearizer linearizer_;
  SchurComplement complement_;
  Damping damping_;
  BundleState state_, candidate_;
  BundleEquations current_, next_;
  BundleStep step_;
};

}  // namespace

BundlePassResult minimize_with_schur(BundleProblem& problem, const BundlePass& pass) {
  return SchurSolver(problem, pass).run();
}

}  // namespace rover
