#include "rover/optimization/bundle_equations.h"

#include <algorithm>
#include <numeric>

namespace rover {
namespace {

// Stable counting sort of `order` by key(element) in [0, keys).
template <class Key>
std::vector<int> sorted_by(const std::vector<int>& order, std::size_t keys, const Key& key) {
  std::vector<int> place(keys + 1, 0);
  for (const int element : order) ++place[key(element) + 1];
  std::partial_sum(place.begin(), place.end(), place.begin());
  std::vector<int> result(order.size());
  for (const int element : order) result[place[key(element)]++] = element;
  return result;
}

std::vector<int> sweep_order(const BundleProblem& problem, const std::vector<char>& active) {
  std::vector<int> order;
  order.reserve(active.size());
  for (std::size_t i = 0; i < active.size(); ++i) {
    if (active[i]) order.push_back(static_cast<int>(i));
  }
  const auto& seen = problem.observations;
  order = sorted_by(order, problem.world_from_body.size(), [&](int i) { return seen[i].pose; });
  return sorted_by(order, problem.points.size(), [&](int i) { return seen[i].point; });
}

}  // namespace

BundleStructure::BundleStructure(const BundleProblem& problem, const std::vector<char>& active) {
  std::vector<int> slots(problem.world_from_body.size(), -1);
  for (std::size_t pose = 0; pose < slots.size(); ++pose) {
    if (problem.pose_fixed[pose]) continue;
    slots[pose] = static_cast<int>(free_poses.size());
    free_poses.push_back(static_cast<int>(pose));
  }
  observations.reserve(active.size());
  edges.reserve(active.size());
  for (const int index : sweep_order(problem, active)) {
    const BundleObservation& seen = problem.observations[index];
    const int place = static_cast<int>(observations.size());
    const bool new_point = tracks.empty() || tracks.back().point != seen.point;
    const int edge = static_cast<int>(edges.size());
    if (new_point) tracks.push_back({seen.point, edge, edge});
    if (new_point || edges.back().pose != seen.pose) {
      edges.push_back({seen.pose, slots[seen.pose], place, place});
      ++tracks.back().end;
    }
    edges.back().end = place + 1;
    observations.push_back(seen);
  }
  for (const auto& track : tracks) longest_track = std::max(longest_track, track.end - track.begin);
}

BundleLinearizer::BundleLinearizer(const BundleProblem& problem, const BundleStructure& structure,
                                   const BundlePass& pass)
    : structure_(structure),
      gauge_(pass.gauge),
      reprojector_(problem.rig),
      kernel_{pass.options.huber} {}

void BundleLinearizer::reset(BundleEquations& equations) const {
  equations.cost = 0;
  equations.pose_hessian.assign(structure_.free_poses.size(), Matrix6d::Zero());
  equations.pose_gradient.assign(structure_.free_poses.size(), Vector6d::Zero());
  equations.point_hessian.assign(structure_.tracks.size(), Eigen::Matrix3d::Zero());
  equations.point_gradient.assign(structure_.tracks.size(), Eigen::Vector3d::Zero());
  equations.cross.resize(structure_.edges.size());
}

PointInformation BundleLinearizer::gather(const BundleEdge& edge,
                                          const Eigen::Vector3d& point_in_body,
                                          double& cost) const {
  PointInformation information;
  Eigen::Vector2d residual;
  Matrix23d jacobian;
  ObservedPoint point(reprojector_, point_in_body, true);
  for (int i = edge.begin; i < edge.end; ++i) {
    const BundleObservation& seen = structure_.observations[i];
    if (!point.evaluate(seen.camera, seen.pixel, seen.sigma, residual, &jacobian)) {
      cost += 0.5 * kernel_.rho(kUnseenChi2);
      continue;
    }
    const double squared = residual.squaredNorm();
    cost += 0.5 * kernel_.rho(squared);
    const double weight = kernel_.weight(squared);
    if (weight > 0) information.add(jacobian, residual, weight);
  }
  return information;
}

void BundleLinearizer::linearize(const BundleState& state, BundleEquations& equations) const {
  reset(equations);
  const std::vector<BodyFrame> frames(state.world_from_body.begin(), state.world_from_body.end());
  for (std::size_t t = 0; t < structure_.tracks.size(); ++t) {
    const BundleTrack& track = structure_.tracks[t];
    const Eigen::Vector3d& point = state.points[track.point];
    for (int e = track.begin; e < track.end; ++e) {
      const BundleEdge& edge = structure_.edges[e];
      const BodyFrame& frame = frames[edge.pose];
      const Eigen::Vector3d x = frame.from_world(point);
      const PointInformation information = gather(edge, x, equations.cost);
      const Eigen::Matrix3d turned = frame.rotation.lazyProduct(information.hessian);
      equations.point_hessian[t].noalias() += turned.lazyProduct(frame.rotation.transpose());
      equations.point_gradient[t].noalias() += frame.rotation * information.gradient;
      if (edge.slot < 0) continue;
      information.add_to_pose(x, equations.pose_hessian[edge.slot],
                              equations.pose_gradient[edge.slot]);
      equations.cross[e] = information.cross(x, frame.rotation);
    }
  }
  if (gauge_.pose >= 0) hold_scale(state, equations);
}

// Projects the held direction n out of the blocks of its pose, P = I - n n^T, and puts a pivot of
// ordinary size in its place: the step along n is then zero, and every block stays 6 wide.
void BundleLinearizer::hold_scale(const BundleState& state, BundleEquations& equations) const {
  const auto& free = structure_.free_poses;
  const auto slot = std::find(free.begin(), free.end(), gauge_.pose) - free.begin();
  const Vector6d n = gauge_.held_direction(state.world_from_body[gauge_.pose]);
  const Matrix6d projector = Matrix6d::Identity() - n * n.transpose();
  Matrix6d& hessian = equations.pose_hessian[slot];
  const double pivot = std::max(hessian.trace() / 6, 1e-6);
  hessian = (projector * hessian * projector + pivot * n * n.transpose()).eval();
  equations.pose_gradient[slot] = (projector * equations.pose_gradient[slot]).eval();
  for (std::size_t e = 0; e < structure_.edges.size(); ++e) {
    if (structure_.edges[e].slot != slot) continue;
    equations.cross[e] -= n * (n.transpose() * equations.cross[e]).eval();
  }
}

}  // namespace rover
