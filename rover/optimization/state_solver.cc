#include "rover/optimization/state_solver.h"

#include <algorithm>
#include <set>

namespace rover {
namespace {

constexpr int kState = 15;
constexpr int kPose = 6;
constexpr int kRest = kState - kPose;  // velocity and biases

using Vector9d = Eigen::Matrix<double, kRest, 1>;

// Which blocks (by their first row) each state's velocity and biases depend on.
std::vector<std::set<int>> neighbours_of(int states,
                                         const std::vector<std::pair<int, int>>& links) {
  std::vector<std::set<int>> result(static_cast<std::size_t>(states));
  for (int i = 0; i < states; ++i) result[i].insert(kState * i);
  for (const auto& [a, b] : links) {
    result[a].insert({kState * b, kState * b + kPose});
    result[b].insert({kState * a, kState * a + kPose});
  }
  return result;
}

bool is_pose(int row) { return row % kState == 0; }

}  // namespace

StateSolver::StateSolver(int states, const std::vector<std::pair<int, int>>& links)
    : states_(states) {
  auto neighbours = neighbours_of(states, links);
  std::set<int> left;
  for (int i = 0; i < states; ++i) left.insert(i);
  while (!left.empty()) {
    const int next = *std::min_element(left.begin(), left.end(), [&](int a, int b) {
      return neighbours[a].size() < neighbours[b].size();
    });
    left.erase(next);
    Elimination& own = order_.emplace_back();
    own.row = kState * next + kPose;
    for (const int row : neighbours[next]) {
      own.neighbours.emplace_back(row, is_pose(row) ? kPose : kRest);
      own.size += own.neighbours.back().second;
      if (is_pose(row)) continue;
      std::set<int>& other = neighbours[row / kState];  // inherits what it was joined by
      other.insert(neighbours[next].begin(), neighbours[next].end());
      other.erase(row);
      other.erase(own.row);
    }
  }
}

bool StateSolver::solve(Eigen::MatrixXd& matrix, Eigen::VectorXd& right_side) {
  matrix.triangularView<Eigen::StrictlyUpper>() = matrix.transpose();
  for (Elimination& own : order_) {
    if (!eliminate(own, matrix, right_side)) return false;
  }
  if (!solve_poses(matrix, right_side)) return false;
  for (auto own = order_.rbegin(); own != order_.rend(); ++own) substitute_back(*own, right_side);
  return right_side.allFinite();
}

// Subtracts B A^-1 B^T from the neighbours, with A = L L^T and the panel Y = B L^-T.
bool StateSolver::eliminate(Elimination& own, Eigen::MatrixXd& matrix,
                            Eigen::VectorXd& right_side) {
  own.factor.compute(matrix.block<kRest, kRest>(own.row, own.row));
  if (own.factor.info() != Eigen::Success) return false;
  own.panel.resize(own.size, kRest);
  int at = 0;
  for (const auto& [row, size] : own.neighbours) {
    own.panel.middleRows(at, size) = matrix.block(row, own.row, size, kRest);
    at += size;
  }
  own.factor.matrixU().solveInPlace<Eigen::OnTheRight>(own.panel);
  auto mine = right_side.segment<kRest>(own.row);
  own.factor.matrixL().solveInPlace(mine);
  const Eigen::MatrixXd product = own.panel * own.panel.transpose();
  const Eigen::VectorXd pull = own.panel * mine;
  int a = 0;
  for (const auto& [row, rows] : own.neighbours) {
    right_side.segment(row, rows) -= pull.segment(a, rows);
    int b = 0;
    for (const auto& [column, columns] : own.neighbours) {
      matrix.block(row, column, rows, columns) -= product.block(a, b, rows, columns);
      b += columns;
    }
    a += rows;
  }
  return true;
}

bool StateSolver::solve_poses(const Eigen::MatrixXd& matrix, Eigen::VectorXd& right_side) const {
  Eigen::MatrixXd poses(kPose * states_, kPose * states_);
  Eigen::VectorXd values(kPose * states_);
  for (int i = 0; i < states_; ++i) {
    values.segment<kPose>(kPose * i) = right_side.segment<kPose>(kState * i);
    for (int j = 0; j <= i; ++j)
      poses.block<kPose, kPose>(kPose * i, kPose * j) =
          matrix.block<kPose, kPose>(kState * i, kState * j);
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(poses);
  if (cholesky.info() != Eigen::Success) return false;
  cholesky.solveInPlace(values);
  for (int i = 0; i < states_; ++i)
    right_side.segment<kPose>(kState * i) = values.segment<kPose>(kPose * i);
  return true;
}

void StateSolver::substitute_back(const Elimination& own, Eigen::VectorXd& right_side) const {
  Vector9d mine = right_side.segment<kRest>(own.row);
  int at = 0;
  for (const auto& [row, size] : own.neighbours) {
    mine -= own.panel.middleRows(at, size).transpose() * right_side.segment(row, size);
    at += size;
  }
  right_side.segment<kRest>(own.row) = own.factor.matrixU().solve(mine);
}

}  // namespace rover
