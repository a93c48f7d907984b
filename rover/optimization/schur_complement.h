#pragma once

#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "rover/imu/inertial_state.h"
#include "rover/optimization/bundle_equations.h"
#include "rover/optimization/damping.h"
#include "rover/optimization/dense_equations.h"
#include "rover/optimization/state_solver.h"

namespace rover {

struct BundleStep {
  Eigen::VectorXd states;               // per slot
  std::vector<Eigen::Vector3d> points;  // per track
  double predicted_decrease = 0;
};

// Solves damped normal equations of a bundle adjustment by elimination of the points: Triggs et
// al., "Bundle adjustment - a modern synthesis" (2000), section 6.1. Each free pose may be the
// beginning of a longer state (velocity, biases) that other terms than reprojection depend on.
class SchurComplement {
 public:
  explicit SchurComplement(const BundleStructure& structure);

  // With whole inertial states, of which `links` (pairs of slots) share terms. `more` states follow
  // those of the free poses: no point depends on them.
  SchurComplement(const BundleStructure& structure, const std::vector<std::pair<int, int>>& links,
                  int more = 0);

  // False where the damped system is not positive definite to rounding: damp more. `states`, if
  // given, holds what is added to the equations of the states.
  bool solve(const BundleEquations& equations, const DenseEquations* states, const Damping& damping,
             BundleStep& step);

  // The information of all free states with the points marginalised (held directions as any other);
  // an empty matrix where a point is not observed.
  Eigen::MatrixXd information(const BundleEquations& equations, const DenseEquations& states);

  // The covariance of all free states, the points' uncertainty included; held directions have none.
  // An empty matrix where something is not observed.
  Eigen::MatrixXd covariance(const BundleEquations& equations, const DenseEquations& states);

  // That covariance times given columns, for the price of a step. Nothing where something is not
  // observed.
  std::optional<Eigen::MatrixXd> covariance_times(const BundleEquations& equations,
                                                  const DenseEquations& states,
                                                  const Eigen::MatrixXd& columns);
  // The diagonal block of it that one whole state has, its unknowns from `row` on.
  std::optional<Matrix15d> covariance_of(int row, const BundleEquations& equations,
                                         const DenseEquations& states);

 private:
  SchurComplement(const BundleStructure& structure, int stride, int more);
  bool solve_reduced();

  using Factor = Eigen::LLT<Eigen::Matrix3d>;

  void start(const BundleEquations& equations, const DenseEquations* states,
             const Damping& damping);
  bool reduce(const BundleEquations& equations, const DenseEquations* states,
              const Damping& damping);
  bool eliminate(std::size_t track_index, const BundleEquations& equations, const Damping& damping);
  void subtract_products(const BundleTrack& track, int edge, const Matrix63d& y);
  void substitute_back(const BundleEquations& equations, const Damping& damping,
                       BundleStep& step) const;
  double states_decrease(const Eigen::VectorXd& delta) const;
  Eigen::Vector3d point_step(std::size_t track_index, const BundleEquations& equations,
                             const BundleStep& step) const;

  const BundleStructure& structure_;
  int stride_;  // unknowns per free pose, of which the first 6 are the pose's
  std::optional<StateSolver> state_solver_;
  Eigen::MatrixXd reduced_;  // lower half
  Eigen::VectorXd right_side_;
  Eigen::VectorXd gradient_;         // of the states, before elimination
  Eigen::VectorXd added_;            // damping on the diagonal of the states
  std::vector<Factor> factors_;      // per track
  std::vector<Matrix63d> whitened_;  // of the track being eliminated
};

}  // namespace rover
