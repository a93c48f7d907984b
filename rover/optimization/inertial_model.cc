#include "rover/optimization/inertial_model.h"

namespace rover {
namespace {

constexpr int kStride = 15;

// Pairs of slots that are both free.
std::vector<std::pair<int, int>> linked_slots(const InertialBundleProblem& problem,
                                              const BundleStructure& structure) {
  std::vector<int> slots(problem.bundle.world_from_body.size(), -1);
  const auto& free = structure.free_poses;
  for (std::size_t slot = 0; slot < free.size(); ++slot) slots[free[slot]] = static_cast<int>(slot);
  std::vector<std::pair<int, int>> links;
  for (const InertialLink& link : problem.links) {
    if (slots[link.from] >= 0 && slots[link.to] >= 0)
      links.emplace_back(slots[link.from], slots[link.to]);
  }
  return links;
}

}  // namespace

InertialBundleModel::InertialBundleModel(const InertialBundleProblem& problem,
                                         const BundlePass& pass)
    : problem_(problem),
      structure_(problem.bundle, pass.active),
      linearizer_(problem.bundle, structure_, pass),
      complement_(structure_, linked_slots(problem, structure_)),
      rows_(problem.bundle.world_from_body.size(), -1) {
  const auto& free = structure_.free_poses;
  for (std::size_t slot = 0; slot < free.size(); ++slot)
    rows_[free[slot]] = static_cast<int>(kStride * slot);
  if (free.size() == rows_.size() && !free.empty()) gauge_pose_ = free.front();
}

InertialBundleModel::State InertialBundleModel::initial(const InertialBundleProblem& problem) {
  return {{problem.bundle.world_from_body, problem.bundle.points}, problem.velocity, problem.bias};
}

void InertialBundleModel::write(const State& state, InertialBundleProblem& problem) {
  problem.bundle.world_from_body = state.bundle.world_from_body;
  problem.bundle.points = state.bundle.points;
  problem.velocity = state.velocity;
  problem.bias = state.bias;
}

void InertialBundleModel::linearize(const State& state, Equations& equations) const {
  linearizer_.linearize(state.bundle, equations.visual);
  DenseEquations& states = equations.states;
  states.reset(static_cast<int>(kStride * structure_.free_poses.size()));
  for (const InertialLink& link : problem_.links) {
    const int from = rows_[link.from], to = rows_[link.to];
    if (from < 0 && to < 0) continue;
    add_imu_factor(link.motion, state.at(link.from), state.at(link.to), problem_.gravity, from, to,
                   states);
  }
  for (const auto& [pose, prior] : problem_.priors)
    add_prior(prior, state.at(pose), rows_[pose], states);
  pin_unobserved(states);
  states.held = held_directions(state);
  equations.cost = equations.visual.cost + states.cost;
}

// Velocities and biases that nothing depends on get a unit pivot: they stay where they are.
void InertialBundleModel::pin_unobserved(DenseEquations& equations) const {
  for (Eigen::Index i = 0; i < equations.hessian.rows(); ++i) {
    if (i % kStride >= 6 && equations.hessian(i, i) == 0) equations.hessian(i, i) = 1;
  }
}

// Position and the turn about gravity, in the tangent of the gauge's pose.
Eigen::MatrixXd InertialBundleModel::held_directions(const State& state) const {
  if (gauge_pose_ < 0) return {};
  const SE3& pose = state.bundle.world_from_body[gauge_pose_];
  const auto unknowns = static_cast<Eigen::Index>(kStride * structure_.free_poses.size());
  Eigen::MatrixXd held = Eigen::MatrixXd::Zero(unknowns, 4);
  held.block<3, 3>(rows_[gauge_pose_], 0).setIdentity();
  held.block<3, 1>(rows_[gauge_pose_] + 3, 3) =
      pose.rotation.conjugate() * problem_.gravity.normalized();
  return held;
}

bool InertialBundleModel::solve(const Equations& equations, const Damping& damping, Step& step) {
  return complement_.solve(equations.visual, &equations.states, damping, step);
}

void InertialBundleModel::move(const State& from, const Step& step, State& to) const {
  to = from;
  for (std::size_t slot = 0; slot < structure_.free_poses.size(); ++slot) {
    const int pose = structure_.free_poses[slot];
    const InertialState moved =
        state_plus(from.at(pose), step.states.segment<kStride>(rows_[pose]));
    to.bundle.world_from_body[pose] = moved.world_from_body;
    to.velocity[pose] = moved.velocity;
    to.bias[pose] = moved.bias;
  }
  for (std::size_t t = 0; t < step.points.size(); ++t)
    to.bundle.points[structure_.tracks[t].point] += step.points[t];
}

Eigen::MatrixXd InertialBundleModel::information(const Equations& equations) {
  return complement_.information(equations.visual, equations.states);
}

Eigen::MatrixXd InertialBundleModel::covariance(const Equations& equations) {
  return complement_.covariance(equations.visual, equations.states);
}

std::optional<double> InertialBundleModel::variance(const Equations& equations,
                                                    const Eigen::VectorXd& by_states) {
  return complement_.variance(equations.visual, equations.states, by_states);
}

std::optional<Matrix15d> InertialBundleModel::covariance_of(int pose, const Equations& equations) {
  if (rows_[pose] < 0) return std::nullopt;
  return complement_.covariance_of(rows_[pose], equations.visual, equations.states);
}

}  // namespace rover
