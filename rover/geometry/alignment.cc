#include "rover/geometry/alignment.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <Eigen/SVD>

namespace rover {
namespace {

// Below this ratio of extents the rotation is rounding noise.
constexpr double kMinSpread = 1e-5;

struct Moments {
  Eigen::Vector3d mean_from = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_to = Eigen::Vector3d::Zero();
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();  // of to by from, about the means
  double variance_from = 0;
  double variance_to = 0;
};

Moments moments(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to) {
  const auto count = static_cast<double>(from.size());
  Moments m;
  for (std::size_t i = 0; i < from.size(); ++i) {
    m.mean_from += from[i] / count;
    m.mean_to += to[i] / count;
  }
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Eigen::Vector3d f = from[i] - m.mean_from, t = to[i] - m.mean_to;
    m.cross += t * f.transpose() / count;
    m.variance_from += f.squaredNorm() / count;
    m.variance_to += t.squaredNorm() / count;
  }
  return m;
}

// The extent of rounding, below which points lie in one place.
bool in_one_place(const Moments& m) {
  const auto tiny = [](double variance, const Eigen::Vector3d& mean) {
    return !(std::sqrt(variance) > 1e-12 * mean.norm()) || !(variance > 0);
  };
  return tiny(m.variance_from, m.mean_from) || tiny(m.variance_to, m.mean_to);
}

struct Turn {
  Eigen::Quaterniond rotation;
  double gain;  // trace of D S in Umeyama's equation 42
  double spread;
};

Turn turn_freely(const Moments& m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m.cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = svd.matrixU().determinant() * svd.matrixV().determinant() < 0 ? -1 : 1;
  const Eigen::Vector3d s(1, 1, sign), values = svd.singularValues();
  const Eigen::Matrix3d rotation = svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose();
  return {Eigen::Quaterniond(rotation), values.dot(s), std::sqrt(values[1] / values[0])};
}

// The yaw that maximises the trace of R^T cross.
Turn turn_about_vertical(const Moments& m) {
  const double along = m.cross(0, 0) + m.cross(1, 1), across = m.cross(1, 0) - m.cross(0, 1);
  const double gain = std::hypot(along, across);
  const double whole = std::sqrt(m.variance_from * m.variance_to);
  return {so3_exp({0, 0, std::atan2(across, along)}), gain, std::sqrt(std::min(1.0, gain / whole))};
}

double rms_after(const Sim3& transform, std::span<const Eigen::Vector3d> from,
                 std::span<const Eigen::Vector3d> to) {
  double sum = 0;
  for (std::size_t i = 0; i < from.size(); ++i) sum += (to[i] - transform * from[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(from.size()));
}

}  // namespace

std::optional<PointAlignment> align_points(std::span<const Eigen::Vector3d> from,
                                           std::span<const Eigen::Vector3d> to,
                                           AlignmentKind kind) {
  const std::size_t needed = kind == AlignmentKind::kUpright ? 2 : 3;
  if (from.size() != to.size() || from.size() < needed) return std::nullopt;
  const Moments m = moments(from, to);
  if (!m.cross.allFinite() || in_one_place(m)) return std::nullopt;
  const Turn turn = kind == AlignmentKind::kUpright ? turn_about_vertical(m) : turn_freely(m);
  if (!(turn.spread > kMinSpread)) return std::nullopt;
  PointAlignment result;
  Sim3& transform = result.to_from_from;
  transform.rotation = turn.rotation;
  if (kind == AlignmentKind::kSimilarity) transform.scale = turn.gain / m.variance_from;
  transform.translation = m.mean_to - transform.scale * (transform.rotation * m.mean_from);
  result.rms = rms_after(transform, from, to);
  result.spread = turn.spread;
  return result;
}

}  // namespace rover
