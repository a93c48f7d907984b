#include "rover/geometry/homography.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace rover {
namespace {

constexpr double kChiSquare95TwoDegrees = 5.991;
// A matrix of norm 1 whose determinant is smaller squeezes space to a plane (a rotation: 0.19).
constexpr double kMinDeterminant = 1e-7;

using Basis = Eigen::Matrix<double, 3, 2>;
using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix29d = Eigen::Matrix<double, 2, 9>;

// Rows of tangent^T H first = 0 in the columns of H, one under the other.
Matrix29d constraint(const Eigen::Matrix<double, 2, 3>& across, const Eigen::Vector3d& first) {
  Matrix29d rows;
  rows << first.x() * across, first.y() * across, first.z() * across;
  return rows;
}

// Where H puts the first bearing, as seen from the second one, and how sure that is.
struct Transfer {
  Eigen::Vector2d error;
  Eigen::Matrix2d information;           // for unit deviation of both bearings
  Eigen::Matrix<double, 2, 3> by_moved;  // derivative of the error by H * first
};

std::optional<Transfer> transfer(const Eigen::Matrix3d& homography, const BearingPair& pair) {
  const Eigen::Vector3d moved = homography * pair.first;
  if (!(moved.dot(pair.second) > 0)) return std::nullopt;
  const double length = moved.norm();
  const Eigen::Vector3d unit = moved / length;
  const Basis across = tangent_basis(pair.second);
  Transfer result;
  result.error = across.transpose() * unit;
  result.by_moved =
      across.transpose() * (Eigen::Matrix3d::Identity() - unit * unit.transpose()) / length;
  const Eigen::Matrix2d by_first = result.by_moved * homography * tangent_basis(pair.first);
  result.information = (Eigen::Matrix2d::Identity() + by_first * by_first.transpose()).inverse();
  return result;
}

struct HomographyEquations {
  Eigen::Matrix<double, 9, 9> h = Eigen::Matrix<double, 9, 9>::Zero();
  Vector9d gradient = Vector9d::Zero();
  double cost = 0;
};

HomographyEquations homography_equations(std::span<const BearingPair> pairs,
                                         const Eigen::Matrix3d& homography,
                                         const std::vector<int>& indices) {
  HomographyEquations sum;
  for (const int i : indices) {
    const auto t = transfer(homography, pairs[i]);
    if (!t) {
      sum.cost = std::numeric_limits<double>::infinity();
      continue;
    }
    const Matrix29d jacobian = constraint(t->by_moved, pairs[i].first);
    sum.h += jacobian.transpose() * t->information * jacobian;
    sum.gradient += jacobian.transpose() * t->information * t->error;
    sum.cost += t->error.dot(t->information * t->error);
  }
  return sum;
}

// The sign by which pairs stay in front, if they agree on one.
std::optional<Eigen::Matrix3d> with_positive_depth(const Eigen::Matrix3d& homography,
                                                   std::span<const BearingPair> pairs) {
  int positive = 0;
  for (const auto& pair : pairs) positive += pair.second.dot(homography * pair.first) > 0;
  const int count = static_cast<int>(pairs.size());
  if (positive != 0 && positive != count) return std::nullopt;
  const Eigen::Matrix3d result = positive == 0 ? Eigen::Matrix3d(-homography) : homography;
  // A camera on the other side of the plane would mirror it.
  if (!(result.determinant() > kMinDeterminant)) return std::nullopt;
  return result;
}

class HomographyProblem {
 public:
  using Model = Eigen::Matrix3d;
  static constexpr int kSampleSize = 4;

  HomographyProblem(std::span<const BearingPair> pairs, double sigma)
      : pairs_(pairs), threshold_(kChiSquare95TwoDegrees * sigma * sigma) {}

  int size() const { return static_cast<int>(pairs_.size()); }
  double threshold() const { return threshold_; }
  std::array<int, kSampleSize> sample(Random& random) const {
    return draw_sample<kSampleSize>(size(), random);
  }
  std::vector<Model> solve(const std::array<int, kSampleSize>& sample) const {
    std::array<BearingPair, kSampleSize> chosen;
    for (int k = 0; k < kSampleSize; ++k) chosen[k] = pairs_[sample[k]];
    const auto model = solve_homography(chosen);
    return model ? std::vector<Model>{*model} : std::vector<Model>{};
  }
  double squared_error(const Model& model, int i) const {
    return homography_squared_error(model, pairs_[i]);
  }
  Model refine(const Model& model, const std::vector<int>& inliers) const {
    return refine_homography(pairs_, model, inliers);
  }

 private:
  std::span<const BearingPair> pairs_;
  double threshold_;
};

// The rotation and direction of translation that go with one of the two planes: u is a direction
// in it whose length H keeps, as it keeps that of v.
SE3 pose_of_plane(const Eigen::Matrix3d& h, const Eigen::Vector3d& v, const Eigen::Vector3d& u) {
  const Eigen::Vector3d normal = v.cross(u);
  Eigen::Matrix3d before, after;
  before << v, u, normal;
  after << h * v, h * u, (h * v).cross(h * u);
  const Eigen::Matrix3d rotation = after * before.transpose();
  return {Eigen::Quaterniond(rotation).normalized(), ((h - rotation) * normal).normalized()};
}

}  // namespace

double homography_squared_error(const Eigen::Matrix3d& homography, const BearingPair& pair) {
  const auto t = transfer(homography, pair);
  return t ? t->error.dot(t->information * t->error) : std::numeric_limits<double>::infinity();
}

std::optional<Eigen::Matrix3d> solve_homography(std::span<const BearingPair> pairs) {
  if (pairs.size() < HomographyProblem::kSampleSize) return std::nullopt;
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (const auto& pair : pairs) {
    const Matrix29d rows = constraint(tangent_basis(pair.second).transpose(), pair.first);
    normal += rows.transpose() * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(normal);
  // A second null direction: three of the four points on one line, or coincident pairs.
  if (!(solver.eigenvalues()[1] > 1e-12 * solver.eigenvalues()[8])) return std::nullopt;
  const Vector9d null = solver.eigenvectors().col(0);
  return with_positive_depth(Eigen::Map<const Eigen::Matrix3d>(null.data()), pairs);
}

Eigen::Matrix3d refine_homography(std::span<const BearingPair> pairs,
                                  const Eigen::Matrix3d& homography,
                                  const std::vector<int>& indices, int max_iterations) {
  Eigen::Matrix3d model = homography / homography.norm();
  HomographyEquations current = homography_equations(pairs, model, indices);
  for (int i = 0; i < max_iterations; ++i) {
    // The errors do not depend on H's length: its direction is kept out of the step.
    const Vector9d along = Eigen::Map<const Vector9d>(model.data());
    current.h += current.h.trace() * along * along.transpose();
    const Vector9d step = -current.h.ldlt().solve(current.gradient);
    if (!step.allFinite()) break;
    Eigen::Matrix3d next = model + Eigen::Map<const Eigen::Matrix3d>(step.data());
    next /= next.norm();
    const HomographyEquations ahead = homography_equations(pairs, next, indices);
    if (!(ahead.cost < current.cost)) break;
    const bool converged = ahead.cost > (1 - 1e-9) * current.cost;
    model = next;
    current = ahead;
    if (converged) break;
  }
  return model;
}

std::optional<RansacResult<Eigen::Matrix3d>> estimate_homography(std::span<const BearingPair> pairs,
                                                                 double sigma,
                                                                 const RansacOptions& options) {
  if (pairs.size() < HomographyProblem::kSampleSize) return std::nullopt;
  return ransac(HomographyProblem(pairs, sigma), options);
}

std::vector<SE3> decompose_homography(const Eigen::Matrix3d& homography) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(homography.transpose() * homography);
  const Eigen::Vector3d singular = solver.eigenvalues().cwiseMax(0).cwiseSqrt();
  const Eigen::Matrix3d h = homography / singular[1];
  const double s1 = singular[2] / singular[1], s3 = singular[0] / singular[1];
  constexpr double kRotationOnly = 1e-9;
  if (!(s1 - s3 > kRotationOnly)) return {};
  const Eigen::Matrix3d v = solver.eigenvectors().rowwise().reverse();
  const double a = std::sqrt(std::max(0.0, 1 - s3 * s3)), b = std::sqrt(std::max(0.0, s1 * s1 - 1));
  std::vector<SE3> poses;
  for (const double sign : {1.0, -1.0}) {
    const Eigen::Vector3d u = (a * v.col(0) + sign * b * v.col(2)) / std::sqrt(s1 * s1 - s3 * s3);
    const SE3 pose = pose_of_plane(h, v.col(1), u);
    poses.push_back(pose);
    poses.emplace_back(pose.rotation, -pose.translation);
  }
  return poses;
}

}  // namespace rover
