#pragma once

#include <utility>
#include <vector>

#include <Eigen/Cholesky>

namespace rover {

// Solves symmetric positive definite systems over inertial states, of 15 unknowns each: the pose's
// 6, then velocity and biases. The latter depend only on their neighbours in time and are
// eliminated first, those with the fewest neighbours before others (minimum degree), so that only
// the poses are left for a dense factorisation: with hundreds of keyframes fifteen times less work.
class StateSolver {
 public:
  // `links`: pairs of states that share a term besides what poses share with poses.
  StateSolver(int states, const std::vector<std::pair<int, int>>& links);

  // Replaces `right_side` by the solution; destroys `matrix`, of which the lower half is read.
  // False where the matrix is not positive definite to rounding.
  bool solve(Eigen::MatrixXd& matrix, Eigen::VectorXd& right_side);

 private:
  // A state's velocity and biases, with the blocks that they depend on when it is their turn.
  struct Elimination {
    int row = 0;
    std::vector<std::pair<int, int>> neighbours;  // row, size
    int size = 0;                                 // of all neighbours
    Eigen::LLT<Eigen::Matrix<double, 9, 9>> factor;
    Eigen::Matrix<double, Eigen::Dynamic, 9> panel;  // neighbours by own, times factor^-T
  };

  bool eliminate(Elimination& own, Eigen::MatrixXd& matrix, Eigen::VectorXd& right_side);
  bool solve_poses(const Eigen::MatrixXd& matrix, Eigen::VectorXd& right_side) const;
  void substitute_back(const Elimination& own, Eigen::VectorXd& right_side) const;

  int states_;
  std::vector<Elimination> order_;
};

}  // namespace rover
