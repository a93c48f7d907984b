#include "rover/optimization/inertial_model.h"

#include "rover/optimization/map_error.h"

namespace rover {
namespace {

constexpr int kStride = 15;

// Pairs of slots that are both unknown; the border's is the last.
std::vector<std::pair<int, int>> linked_slots(const InertialBundleProblem& problem,
                                              const BundleStructure& structure) {
  std::vector<int> slots(problem.bundle.world_from_body.size(), -1);
  const auto& free = structure.free_poses;
  for (std::size_t slot = 0; slot < free.size(); ++slot) slots[free[slot]] = static_cast<int>(slot);
  if (problem.border >= 0) slots[problem.border] = static_cast<int>(free.size());
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
      complement_(structure_, linked_slots(problem, structure_), problem.border >= 0 ? 1 : 0),
      rows_(problem.bundle.world_from_body.size(), -1) {
  const auto& free = structure_.free_poses;
  for (std::size_t slot = 0; slot < free.size(); ++slot)
    rows_[free[slot]] = static_cast<int>(kStride * slot);
  if (problem.border >= 0) rows_[problem.border] = static_cast<int>(kStride * free.size());
  if (free.size() == rows_.size() && !free.empty()) gauge_pose_ = free.front();
}

int InertialBundleModel::unknowns() const {
  const int border = problem_.border >= 0 ? 1 : 0;
  return kStride * (static_cast<int>(structure_.free_poses.size()) + border);
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
  states.reset(unknowns());
  for (const InertialLink& link : problem_.links) {
    const int from = rows_[link.from], to = rows_[link.to];
    if (from < 0 && to < 0) continue;
    add_imu_factor(link.motion, state.at(link.from), state.at(link.to), problem_.gravity, from, to,
                   states);
  }
  for (const auto& [pose, prior] : problem_.priors)
    add_prior(prior, state.at(pose), rows_[pose], states);
  pin_border(states);
  pin_unobserved(states);
  states.held = held_directions(state);
  equations.cost = equations.visual.cost + states.cost;
}

// The border's pose depends on nothing.
void InertialBundleModel::pin_border(DenseEquations& equations) const {
  if (problem_.border < 0) return;
  const int row = rows_[problem_.border];
  equations.hessian.middleRows<6>(row).setZero();
  equations.hessian.middleCols<6>(row).setZero();
  equations.hessian.block<6, 6>(row, row).setIdentity();
  equations.gradient.segment<6>(row).setZero();
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
  Eigen::MatrixXd held = Eigen::MatrixXd::Zero(unknowns(), 4);
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
  for (int pose = 0; pose < static_cast<int>(rows_.size()); ++pose) {
    if (rows_[pose] < 0) continue;
    const InertialState moved =
        state_plus(from.at(pose), step.states.segment<kStride>(rows_[pose]));
    if (pose != problem_.border) to.bundle.world_from_body[pose] = moved.world_from_body;
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

std::optional<Eigen::MatrixXd> InertialBundleModel::covariance_times(
    const Equations& equations, const Eigen::MatrixXd& columns) {
  return complement_.covariance_times(equations.visual, equations.states, columns);
}

// By the implicit function theorem: the error moves every residual's minimum; what remains of the
// residuals along it is answered by the unknowns, d = -H^-1 J^T (J T), with T the error's motion of
// the states that a residual depends on.
std::optional<Eigen::MatrixXd> InertialBundleModel::response(const State& state,
                                                             const Equations& equations) {
  const Eigen::Vector3d lever = problem_.bundle.rig.body_from_camera[0].translation;
  const auto moved = [&](int pose) { return by_map_error(state.at(pose), lever); };
  Eigen::MatrixXd pull = Eigen::MatrixXd::Zero(unknowns(), 3);
  const auto add = [&](int pose, const Matrix15x3d& change) {
    if (rows_[pose] >= 0) pull.middleRows<kStride>(rows_[pose]) += change;
  };
  for (const InertialLink& link : problem_.links) {
    ImuJacobians by;
    imu_residual(link.motion, state.at(link.from), state.at(link.to), problem_.gravity, &by);
    const Matrix15x3d change = by.by_from * moved(link.from) + by.by_to * moved(link.to);
    add(link.from, by.by_from.transpose() * change);
    add(link.to, by.by_to.transpose() * change);
  }
  for (const auto& [pose, prior] : problem_.priors) {
    Matrix15d by_state;
    prior_difference(prior, state.at(pose), &by_state);
    add(pose, by_state.transpose() * prior.information * by_state * moved(pose));
  }
  if (problem_.border >= 0) pull.middleRows<6>(rows_[problem_.border]).setZero();
  return complement_.covariance_times(equations.visual, equations.states, -pull);
}

std::optional<Matrix15d> InertialBundleModel::covariance_of(int pose, const Equations& equations) {
  if (rows_[pose] < 0) return std::nullopt;
  return complement_.covariance_of(rows_[pose], equations.visual, equations.states);
}

}  // namespace rover
