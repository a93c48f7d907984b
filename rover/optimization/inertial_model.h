#pragma once

#include <optional>
#include <vector>

#include "rover/optimization/bundle_pass.h"
#include "rover/optimization/inertial_bundle_adjustment.h"
#include "rover/optimization/schur_complement.h"

namespace rover {

// An inertial bundle adjustment, as LevenbergMarquardt wants it. Of each free pose the whole state
// is unknown, of the border velocity and biases (its pose has rows, too, but stays).
class InertialBundleModel {
 public:
  struct State {
    BundleState bundle;
    std::vector<Eigen::Vector3d> velocity;
    std::vector<ImuBias> bias;

    InertialState at(int pose) const {
      return {bundle.world_from_body[pose], velocity[pose], bias[pose]};
    }
  };
  struct Equations {
    BundleEquations visual;
    DenseEquations states;
    double cost = 0;
  };
  using Step = BundleStep;

  InertialBundleModel(const InertialBundleProblem& problem, const BundlePass& pass);

  static State initial(const InertialBundleProblem& problem);
  static void write(const State& state, InertialBundleProblem& problem);

  void linearize(const State& state, Equations& equations) const;
  bool solve(const Equations& equations, const Damping& damping, Step& step);
  void move(const State& from, const Step& step, State& to) const;

  // Row of a pose's state among the unknowns; -1 if fixed.
  int row(int pose) const { return rows_[pose]; }

  // The information of all unknown states with the points marginalised, the gauge not yet held; and
  // their covariance (an empty matrix where something is not observed).
  Eigen::MatrixXd information(const Equations& equations);
  Eigen::MatrixXd covariance(const Equations& equations);
  // That covariance times a few columns, without the rest of it.
  std::optional<Eigen::MatrixXd> covariance_times(const Equations& equations,
                                                  const Eigen::MatrixXd& columns);
  // Likewise of one free pose's state, without the others'.
  std::optional<Matrix15d> covariance_of(int pose, const Equations& equations);
  // How the unknowns move, in the frame of the map, with an error that the fixed poses and all else
  // have in common (map_error.h). What is seen does not notice it.
  std::optional<Eigen::MatrixXd> response(const State& state, const Equations& equations);
  // What a free pose's observations tell of it, were their points known.
  Matrix6d seen_information(int pose, const Equations& equations) const {
    return equations.visual.pose_hessian[static_cast<std::size_t>(rows_[pose] / 15)];
  }

 private:
  int unknowns() const;
  void pin_unobserved(DenseEquations& equations) const;
  void pin_border(DenseEquations& equations) const;
  Eigen::MatrixXd held_directions(const State& state) const;

  const InertialBundleProblem& problem_;
  BundleStructure structure_;
  BundleLinearizer linearizer_;
  SchurComplement complement_;
  std::vector<int> rows_;
  int gauge_pose_ = -1;
};

}  // namespace rover
