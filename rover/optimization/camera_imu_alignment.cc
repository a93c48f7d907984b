#include "rover/optimization/camera_imu_alignment.h"

#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/SVD>

#include "rover/base/error.h"
#include "rover/imu/preintegration.h"
#include "rover/optimization/dense_equations.h"

namespace rover {
namespace {

constexpr double kGridStep = 0.005;   // s
constexpr double kTimeStep = 0.0005;  // s, of the numeric derivative
constexpr std::size_t kMinTurns = 10;

using Vector7d = Eigen::Matrix<double, 7, 1>;  // rotation, bias, offset
using Matrix37d = Eigen::Matrix<double, 3, 7>;

// A turn that the camera saw.
struct Turn {
  Timestamp from = 0, to = 0;
  Eigen::Quaterniond rotation;  // in the camera's axes
};

std::vector<Turn> turns_of(std::span<const StampedRotation> rotations, double interval) {
  std::vector<Turn> turns;
  std::size_t from = 0;
  for (std::size_t i = 1; i < rotations.size(); ++i) {
    if (seconds_between(rotations[from].time, rotations[i].time) < interval) continue;
    turns.push_back(
        {rotations[from].time, rotations[i].time,
         rotations[from].world_from_camera.conjugate() * rotations[i].world_from_camera});
    from = i;
  }
  return turns;
}

// What the gyroscope says about a turn, the clocks being `offset` seconds apart.
std::optional<Preintegration> measured(const ImuBuffer& imu, const Turn& turn, double offset,
                                       const Eigen::Vector3d& bias) {
  const Timestamp shift = from_seconds(offset);
  auto samples = imu.between(turn.from + shift, turn.to + shift);
  if (samples.empty()) return std::nullopt;
  static const ImuNoise unit = {.gyroscope = 1, .accelerometer = 1, .gap = 1e9};
  return Preintegration(std::move(samples), {bias, Eigen::Vector3d::Zero()}, unit);
}

// Mean squared difference of the angles; infinite where the inertial data do not reach.
double angle_mismatch(const std::vector<Turn>& turns, const ImuBuffer& imu, double offset) {
  double sum = 0;
  std::size_t count = 0;
  for (const Turn& turn : turns) {
    const auto motion = measured(imu, turn, offset, Eigen::Vector3d::Zero());
    if (!motion) continue;
    const double difference =
        so3_log(motion->delta().rotation).norm() - so3_log(turn.rotation).norm();
    sum += difference * difference;
    ++count;
  }
  return 2 * count > turns.size() ? sum / static_cast<double>(count) : HUGE_VAL;
}

double best_offset(const std::vector<Turn>& turns, const ImuBuffer& imu, double max_offset) {
  const int steps = static_cast<int>(max_offset / kGridStep);
  double best = 0, least = HUGE_VAL;
  for (int i = -steps; i <= steps; ++i) {
    const double mismatch = angle_mismatch(turns, imu, i * kGridStep);
    if (mismatch < least) {
      least = mismatch;
      best = i * kGridStep;
    }
  }
  return best;
}

// The rotation that takes the camera's turns to the gyroscope's. Nothing if all are about one axis.
std::optional<Eigen::Quaterniond> matching_rotation(const std::vector<Turn>& turns,
                                                    const ImuBuffer& imu, double offset) {
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (const Turn& turn : turns) {
    const auto motion = measured(imu, turn, offset, Eigen::Vector3d::Zero());
    if (motion) products += so3_log(motion->delta().rotation) * so3_log(turn.rotation).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (svd.singularValues()[1] < 0.01 * svd.singularValues()[0]) return std::nullopt;
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  const Eigen::Matrix3d rotation =
      svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  return Eigen::Quaterniond(rotation);
}

Eigen::Vector3d difference(const Preintegration& motion, const Turn& turn,
                           const Eigen::Quaterniond& body_from_camera) {
  return so3_log(motion.delta().rotation.conjugate() * body_from_camera * turn.rotation *
                 body_from_camera.conjugate());
}

// Residual of one turn and its Jacobian; false where the inertial data do not reach.
bool linearize(const Turn& turn, const ImuBuffer& imu, const CameraImuAlignment& at,
               Eigen::Vector3d& residual, Matrix37d& jacobian) {
  const auto motion = measured(imu, turn, at.time_offset, at.gyroscope_bias);
  const auto later = measured(imu, turn, at.time_offset + kTimeStep, at.gyroscope_bias);
  const auto sooner = measured(imu, turn, at.time_offset - kTimeStep, at.gyroscope_bias);
  if (!motion || !later || !sooner) return false;
  residual = difference(*motion, turn, at.body_from_camera);
  const Eigen::Matrix3d axes = at.body_from_camera.toRotationMatrix();
  // Exp(d) Q Exp(-d) = Q Exp((Q^T - I) d) to first order, with d in the camera's axes.
  jacobian.leftCols<3>() =
      axes * (turn.rotation.toRotationMatrix().transpose() - Eigen::Matrix3d::Identity());
  jacobian.middleCols<3>(3) = -motion->by_bias().block<3, 3>(3, 0);
  jacobian.col(6) = (difference(*later, turn, at.body_from_camera) -
                     difference(*sooner, turn, at.body_from_camera)) /
                    (2 * kTimeStep);
  return true;
}

// Gauss-Newton over everything, then the standard deviations; false where it is not determined.
bool refine(const std::vector<Turn>& turns, const ImuBuffer& imu, int iterations,
            CameraImuAlignment& result) {
  Eigen::Vector3d residual;
  Matrix37d jacobian;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    DenseEquations equations;
    equations.reset(7);
    std::size_t count = 0;
    for (const Turn& turn : turns) {
      if (!linearize(turn, imu, result, residual, jacobian)) continue;
      equations.add(residual, jacobian, 0);
      ++count;
    }
    const Eigen::MatrixXd covariance =
        inverse_of(equations.hessian.selfadjointView<Eigen::Lower>());
    if (count < kMinTurns || covariance.rows() == 0) return false;
    const Vector7d step = -covariance * equations.gradient;
    result.body_from_camera = (result.body_from_camera * so3_exp(step.head<3>())).normalized();
    result.gyroscope_bias += step.segment<3>(3);
    result.time_offset += step[6];
    result.residual = std::sqrt(2 * equations.cost / (3 * static_cast<double>(count)));
    const Vector7d sigma = result.residual * covariance.diagonal().cwiseSqrt();
    result.rotation_sigma = sigma.head<3>().maxCoeff();
    result.time_sigma = sigma[6];
  }
  return std::isfinite(result.residual);
}

}  // namespace

void CameraImuAlignmentOptions::check() const {
  require(max_offset > 0 && max_offset < 10,
          "camera and imu: max_offset is {} s; use more than 0 and less than 10", max_offset);
  require(interval > 0, "camera and imu: interval must be positive, not {} s", interval);
  require(iterations > 0, "camera and imu: iterations must be positive, not {}", iterations);
}

std::optional<CameraImuAlignment> align_camera_to_imu(std::span<const StampedRotation> rotations,
                                                      const ImuBuffer& imu,
                                                      const CameraImuAlignmentOptions& options) {
  options.check();
  const std::vector<Turn> turns = turns_of(rotations, options.interval);
  if (turns.size() < kMinTurns) return std::nullopt;
  CameraImuAlignment result;
  result.gyroscope_bias.setZero();
  result.time_offset = best_offset(turns, imu, options.max_offset);
  const auto rotation = matching_rotation(turns, imu, result.time_offset);
  if (!rotation) return std::nullopt;
  result.body_from_camera = *rotation;
  if (!refine(turns, imu, options.iterations, result)) return std::nullopt;
  return result;
}

}  // namespace rover
