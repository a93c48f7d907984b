#include "rover/optimization/state_solver.h"

#include <gtest/gtest.h>

#include "rover/base/random.h"

namespace rover {
namespace {

Eigen::MatrixXd random_matrix(int rows, int columns, Random& random) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.gaussian(); });
}

// Terms between linked states, and between all poses.
Eigen::MatrixXd random_system(int states, const std::vector<std::pair<int, int>>& links,
                              Random& random) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(15 * states, 15 * states);
  for (const auto& [a, b] : links) {
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(15, 15 * states);
    jacobian.middleCols(15 * a, 15) = random_matrix(15, 15, random);
    jacobian.middleCols(15 * b, 15) = random_matrix(15, 15, random);
    matrix += jacobian.transpose() * jacobian;
  }
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(6 * states, 15 * states);
  for (int i = 0; i < states; ++i)
    jacobian.middleCols(15 * i, 6) = random_matrix(6 * states, 6, random);
  matrix += jacobian.transpose() * jacobian;
  matrix.diagonal().array() += 1;
  return matrix;
}

void expect_solved(int states, const std::vector<std::pair<int, int>>& links) {
  Random random(static_cast<std::uint64_t>(states));
  const Eigen::MatrixXd matrix = random_system(states, links, random);
  const Eigen::VectorXd right_side = random_matrix(15 * states, 1, random);
  Eigen::MatrixXd lower = matrix.triangularView<Eigen::Lower>();
  Eigen::VectorXd solution = right_side;
  StateSolver solver(states, links);
  ASSERT_TRUE(solver.solve(lower, solution));
  EXPECT_LT((matrix * solution - right_side).norm(), 1e-8 * right_side.norm());
}

TEST(StateSolver, SolvesChains) {
  for (const int states : {1, 2, 3, 10, 25}) {
    std::vector<std::pair<int, int>> links;
    for (int i = 1; i < states; ++i) links.emplace_back(i - 1, i);
    expect_solved(states, links);
  }
}

TEST(StateSolver, SolvesBrokenAndUnorderedChains) {
  expect_solved(8, {});
  expect_solved(8, {{0, 1}, {1, 2}, {5, 6}});
  expect_solved(8, {{3, 1}, {1, 7}, {7, 0}, {0, 5}});
  expect_solved(6, {{0, 1}, {1, 2}, {2, 0}, {3, 0}, {3, 4}});  // a loop
}

TEST(StateSolver, RefusesWhatIsNotPositive) {
  Random random(1);
  Eigen::MatrixXd matrix = random_system(4, {{0, 1}, {1, 2}}, random);
  Eigen::VectorXd right_side = Eigen::VectorXd::Ones(60);
  StateSolver solver(4, {{0, 1}, {1, 2}});
  Eigen::MatrixXd broken = matrix;
  broken(20, 20) = -1e6;  // a bias
  EXPECT_FALSE(solver.solve(broken, right_side));
  broken = matrix;
  broken(15, 15) = -1e6;  // a position
  right_side.setOnes();
  EXPECT_FALSE(solver.solve(broken, right_side));
}

}  // namespace
}  // namespace rover
