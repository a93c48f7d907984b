#include "rover/geometry/essential.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <opengv/relative_pose/CentralRelativeAdapter.hpp>
#include <opengv/relative_pose/methods.hpp>

namespace rover {
namespace {

constexpr double kChiSquare95OneDegree = 3.841;
using Vector5d = Eigen::Matrix<double, 5, 1>;

// The squared slope of second^T E first when the bearings move on their spheres.
double squared_slope(const Eigen::Matrix3d& essential, const BearingPair& pair, double value) {
  const Eigen::Vector3d by_second = essential * pair.first;
  const Eigen::Vector3d by_first = essential.transpose() * pair.second;
  return by_second.squaredNorm() + by_first.squaredNorm() - 2 * value * value;
}

struct EpipolarEquations {
  Eigen::Matrix<double, 5, 5> h = Eigen::Matrix<double, 5, 5>::Zero();
  Vector5d gradient = Vector5d::Zero();
  double cost = 0;
};

// Tangent: the turn of the translation on its sphere (2), the rotation on the right (3). The slope
// is held fixed, as it hardly changes within a step.
EpipolarEquations epipolar_equations(std::span<const BearingPair> pairs, const SE3& pose,
                                     const std::vector<int>& indices) {
  const Eigen::Matrix3d r = pose.rotation_matrix(), essential = essential_from_pose(pose);
  const Eigen::Matrix<double, 3, 2> basis = tangent_basis(pose.translation);
  EpipolarEquations sum;
  for (const int i : indices) {
    const BearingPair& pair = pairs[i];
    const Eigen::Vector3d turned = r * pair.first;
    const double value = pair.second.dot(essential * pair.first);
    const double weight = 1 / (squared_slope(essential, pair, value) + 1e-12);
    Vector5d jacobian;
    jacobian.head<2>() = basis.transpose() * turned.cross(pair.second);
    jacobian.tail<3>() = pair.first.cross(r.transpose() * pair.second.cross(pose.translation));
    sum.h += weight * jacobian * jacobian.transpose();
    sum.gradient += weight * value * jacobian;
    sum.cost += weight * value * value;
  }
  return sum;
}

class EssentialProblem {
 public:
  using Model = Eigen::Matrix3d;
  static constexpr int kSampleSize = 5;

  EssentialProblem(std::span<const BearingPair> pairs, double sigma)
      : pairs_(pairs), threshold_(kChiSquare95OneDegree * sigma * sigma) {}

  int size() const { return static_cast<int>(pairs_.size()); }
  double threshold() const { return threshold_; }
  std::array<int, kSampleSize> sample(Random& random) const {
    return draw_sample<kSampleSize>(size(), random);
  }

  // OpenGV's essential matrix is that of first_from_second, so its first view is our second.
  std::vector<Model> solve(const std::array<int, kSampleSize>& sample) const {
    opengv::bearingVectors_t first, second;
    for (const int i : sample) {
      first.push_back(pairs_[i].first);
      second.push_back(pairs_[i].second);
    }
    const opengv::relative_pose::CentralRelativeAdapter adapter(second, first);
    std::vector<Model> models;
    for (const auto& solution : opengv::relative_pose::fivept_stewenius(adapter)) {
      const Model real = solution.real();
      const double size = real.norm();
      if (solution.imag().norm() < 1e-6 * size && std::isfinite(size))
        models.push_back(real / size);
    }
    return models;
  }

  double squared_error(const Model& model, int i) const {
    return epipolar_squared_error(model, pairs_[i]);
  }

  // All four poses of a matrix have the same epipolar errors.
  Model refine(const Model& model, const std::vector<int>& inliers) const {
    return essential_from_pose(
        refine_relative_pose(pairs_, decompose_essential(model)[0], inliers));
  }

 private:
  std::span<const BearingPair> pairs_;
  double threshold_;
};

}  // namespace

Eigen::Matrix3d essential_from_pose(const SE3& second_from_first) {
  return skew(second_from_first.translation) * second_from_first.rotation_matrix();
}

std::array<SE3, 4> decompose_essential(const Eigen::Matrix3d& essential) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU(), v = svd.matrixV(), w;
  if (u.determinant() < 0) u.col(2) *= -1;
  if (v.determinant() < 0) v.col(2) *= -1;
  w << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Eigen::Matrix3d one = u * w * v.transpose(), other = u * w.transpose() * v.transpose();
  const Eigen::Vector3d t = u.col(2);
  return {SE3(one, t), SE3(one, -t), SE3(other, t), SE3(other, -t)};
}

double epipolar_squared_error(const Eigen::Matrix3d& essential, const BearingPair& pair) {
  const double value = pair.second.dot(essential * pair.first);
  // Both bearings on the baseline fit every essential matrix of it.
  const double slope = squared_slope(essential, pair, value);
  return slope > 0 ? value * value / slope : 0;
}

SE3 refine_relative_pose(std::span<const BearingPair> pairs, const SE3& second_from_first,
                         const std::vector<int>& indices, int max_iterations) {
  SE3 pose = second_from_first;
  EpipolarEquations current = epipolar_equations(pairs, pose, indices);
  for (int i = 0; i < max_iterations; ++i) {
    const Vector5d step = -current.h.ldlt().solve(current.gradient);
    if (!step.allFinite()) break;
    const Eigen::Vector3d moved =
        pose.translation + tangent_basis(pose.translation) * step.head<2>();
    const SE3 next((pose.rotation * so3_exp(step.tail<3>())).normalized(), moved.normalized());
    const EpipolarEquations ahead = epipolar_equations(pairs, next, indices);
    if (!(ahead.cost < current.cost)) break;
    const bool converged = ahead.cost > (1 - 1e-9) * current.cost;
    pose = next;
    current = ahead;
    if (converged) break;
  }
  return pose;
}

std::optional<RansacResult<Eigen::Matrix3d>> estimate_essential(std::span<const BearingPair> pairs,
                                                                double sigma,
                                                                const RansacOptions& options) {
  if (pairs.size() < EssentialProblem::kSampleSize) return std::nullopt;
  return ransac(EssentialProblem(pairs, sigma), options);
}

}  // namespace rover
