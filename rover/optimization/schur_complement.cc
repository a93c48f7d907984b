#include "rover/optimization/schur_complement.h"

namespace rover {
namespace {

// Points on a single ray have no certain depth: a trace of damping keeps them solvable.
Damping trace() { return Damping(1e-12); }

}  // namespace

SchurComplement::SchurComplement(const BundleStructure& structure)
    : SchurComplement(structure, 6, 0) {}

SchurComplement::SchurComplement(const BundleStructure& structure,
                                 const std::vector<std::pair<int, int>>& links, int more)
    : SchurComplement(structure, 15, more) {
  state_solver_.emplace(static_cast<int>(structure.free_poses.size()) + more, links);
}

SchurComplement::SchurComplement(const BundleStructure& structure, int stride, int more)
    : structure_(structure), stride_(stride) {
  const auto unknowns = static_cast<Eigen::Index>(stride * (structure.free_poses.size() + more));
  reduced_.resize(unknowns, unknowns);
  right_side_.resize(unknowns);
  added_.resize(unknowns);
  factors_.resize(structure.tracks.size());
  whitened_.resize(structure.longest_track);
}

bool SchurComplement::solve(const BundleEquations& equations, const DenseEquations* states,
                            const Damping& damping, BundleStep& step) {
  if (!reduce(equations, states, damping)) return false;
  if (states) hold_directions(states->held, reduced_, right_side_);
  if (!solve_reduced()) return false;
  substitute_back(equations, damping, step);
  return true;
}

bool SchurComplement::solve_reduced() {
  if (state_solver_) return state_solver_->solve(reduced_, right_side_);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(reduced_);
  if (cholesky.info() != Eigen::Success) return false;
  cholesky.solveInPlace(right_side_);
  return right_side_.allFinite();
}

Eigen::MatrixXd SchurComplement::information(const BundleEquations& equations,
                                             const DenseEquations& states) {
  if (!reduce(equations, &states, trace())) return {};
  return reduced_.selfadjointView<Eigen::Lower>();
}

Eigen::MatrixXd SchurComplement::covariance(const BundleEquations& equations,
                                            const DenseEquations& states) {
  Eigen::MatrixXd held_information = information(equations, states);
  if (held_information.rows() == 0) return {};
  hold_directions(states.held, held_information, right_side_);
  Eigen::MatrixXd result = inverse_of(held_information.selfadjointView<Eigen::Lower>());
  if (result.rows() == 0) return result;
  for (Eigen::Index k = 0; k < states.held.cols(); ++k) {
    const Eigen::VectorXd n = states.held.col(k);
    result -= n * (n.dot(result * n)) * n.transpose();
  }
  return result;
}

std::optional<Eigen::MatrixXd> SchurComplement::covariance_times(const BundleEquations& equations,
                                                                 const DenseEquations& states,
                                                                 const Eigen::MatrixXd& columns) {
  if (!reduce(equations, &states, trace())) return std::nullopt;
  const Eigen::MatrixXd reduced = reduced_;
  Eigen::MatrixXd product(columns.rows(), columns.cols());
  for (Eigen::Index k = 0; k < columns.cols(); ++k) {
    reduced_ = reduced;
    right_side_ = columns.col(k);
    hold_directions(states.held, reduced_, right_side_);
    if (!solve_reduced()) return std::nullopt;
    product.col(k) = right_side_;
  }
  return product;
}

std::optional<Matrix15d> SchurComplement::covariance_of(int row, const BundleEquations& equations,
                                                        const DenseEquations& states) {
  if (!reduce(equations, &states, trace())) return std::nullopt;
  hold_directions(states.held, reduced_, right_side_);
  std::optional<Matrix15d> result = inverse_block(reduced_, row);
  for (Eigen::Index k = 0; result && k < states.held.cols(); ++k) {
    const Vector15d n = states.held.col(k).segment<15>(row);
    *result -= n * (n.dot(*result * n)) * n.transpose();
  }
  return result;
}

bool SchurComplement::reduce(const BundleEquations& equations, const DenseEquations* states,
                             const Damping& damping) {
  start(equations, states, damping);
  for (std::size_t t = 0; t < structure_.tracks.size(); ++t) {
    if (!eliminate(t, equations, damping)) return false;
  }
  return true;
}

void SchurComplement::start(const BundleEquations& equations, const DenseEquations* states,
                            const Damping& damping) {
  if (states) {
    reduced_ = states->hessian;
    gradient_ = states->gradient;
  } else {
    reduced_.setZero();
    gradient_.setZero(right_side_.size());
  }
  for (std::size_t s = 0; s < structure_.free_poses.size(); ++s) {
    const auto row = static_cast<Eigen::Index>(stride_ * s);
    reduced_.block<6, 6>(row, row) += equations.pose_hessian[s];
    gradient_.segment<6>(row) += equations.pose_gradient[s];
  }
  for (Eigen::Index i = 0; i < reduced_.rows(); ++i) added_[i] = damping.of(reduced_(i, i));
  reduced_.diagonal() += added_;
  right_side_ = -gradient_;
}

// Subtracts W H^-1 W^T of one point with H = L L^T, as the products of Y = W L^-T: symmetric and
// positive by construction. Edges come in the order of slots, so only the lower half is written.
bool SchurComplement::eliminate(std::size_t track_index, const BundleEquations& equations,
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
    const int slot = structure_.edges[e].slot;
    if (slot < 0) continue;
    Matrix63d& y = whitened_[e - track.begin];
    y.noalias() = equations.cross[e].lazyProduct(inverse.transpose());
    right_side_.segment<6>(stride_ * slot).noalias() += y * z;
    subtract_products(track, e, y);
  }
  return true;
}

void SchurComplement::subtract_products(const BundleTrack& track, int edge, const Matrix63d& y) {
  const int row = stride_ * structure_.edges[edge].slot;
  for (int other = track.begin; other <= edge; ++other) {
    const int slot = structure_.edges[other].slot;
    if (slot < 0) continue;
    reduced_.block<6, 6>(row, stride_ * slot).noalias() -=
        y.lazyProduct(whitened_[other - track.begin].transpose());
  }
}

void SchurComplement::substitute_back(const BundleEquations& equations, const Damping& damping,
                                      BundleStep& step) const {
  step.states = right_side_;
  step.predicted_decrease = states_decrease(step.states);
  step.points.resize(structure_.tracks.size());
  for (std::size_t t = 0; t < step.points.size(); ++t) {
    const Eigen::Vector3d& delta = step.points[t] = point_step(t, equations, step);
    const Eigen::Matrix3d& hessian = equations.point_hessian[t];
    double sum = 0;
    for (int i = 0; i < 3; ++i)
      sum += delta[i] * (damping.of(hessian(i, i)) * delta[i] - equations.point_gradient[t][i]);
    step.predicted_decrease += 0.5 * sum;
  }
}

// What the states add to the predicted decrease: 0.5 d^T (D d - g), from (H + D) d = -g.
double SchurComplement::states_decrease(const Eigen::VectorXd& delta) const {
  double sum = 0;
  for (Eigen::Index i = 0; i < delta.size(); ++i)
    sum += delta[i] * (added_[i] * delta[i] - gradient_[i]);
  return 0.5 * sum;
}

Eigen::Vector3d SchurComplement::point_step(std::size_t track_index,
                                            const BundleEquations& equations,
                                            const BundleStep& step) const {
  Eigen::Vector3d right_side = -equations.point_gradient[track_index];
  const BundleTrack& track = structure_.tracks[track_index];
  for (int e = track.begin; e < track.end; ++e) {
    const int slot = structure_.edges[e].slot;
    if (slot >= 0)
      right_side.noalias() -=
          equations.cross[e].transpose() * step.states.segment<6>(stride_ * slot);
  }
  return factors_[track_index].solve(right_side);
}

}  // namespace rover
