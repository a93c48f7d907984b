#include "rover/optimization/bundle_ceres.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <functional>
#include <memory>

#include <ceres/ceres.h>
#include <Eigen/QR>

#include "rover/optimization/reprojection.h"
#include "rover/optimization/robust_kernel.h"

namespace rover {
namespace {

constexpr int kPoseSize = 7;                  // qx qy qz qw tx ty tz
constexpr std::size_t kDenseSchurPoses = 60;  // up to here a dense reduced system is faster

using PoseBlock = std::array<double, kPoseSize>;
using LiftedJacobian = Eigen::Matrix<double, 2, kPoseSize, Eigen::RowMajor>;
using RowMajor23d = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;

SE3 unpack(const double* block) {
  return {Eigen::Quaterniond(block[3], block[0], block[1], block[2]),
          Eigen::Vector3d(block[4], block[5], block[6])};
}

void pack(const SE3& pose, double* block) {
  std::copy_n(pose.rotation.coeffs().data(), 4, block);
  std::copy_n(pose.translation.data(), 3, block + 4);
}

// SE3 with the tangent of se3_plus. The residuals' Jacobians are taken by the tangent itself and
// stored in the first six columns of Ceres' "ambient" Jacobian: PlusJacobian only has to select
// them, and the true 7x6 product, which would be undone at once, is never formed.
class PoseManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kPoseSize; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* result) const override {
    pack(se3_plus(unpack(x), Eigen::Map<const Vector6d>(delta)), result);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kPoseSize, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* delta) const override {
    const Vector6d tangent = se3_minus(unpack(y), unpack(x));
    std::copy_n(tangent.data(), 6, delta);
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, kPoseSize, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

// The same for a pose on the sphere of a ScaleGauge: the tangents orthogonal to its radius.
class HeldPoseManifold : public ceres::Manifold {
 public:
  explicit HeldPoseManifold(const ScaleGauge& gauge) : gauge_(gauge) {}

  int AmbientSize() const override { return kPoseSize; }
  int TangentSize() const override { return 5; }
  bool Plus(const double* x, const double* delta, double* result) const override {
    const SE3 pose = unpack(x);
    const Vector6d tangent = basis(pose) * Eigen::Map<const Vector5d>(delta);
    pack(gauge_.restored(se3_plus(pose, tangent)), result);
    return true;
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kPoseSize, 5, Eigen::RowMajor>> result(jacobian);
    result.setZero();
    result.topRows<6>() = basis(unpack(x));
    return true;
  }
  bool Minus(const double* y, const double* x, double* delta) const override {
    const SE3 pose = unpack(x);
    const Vector5d tangent = basis(pose).transpose() * se3_minus(unpack(y), pose);
    std::copy_n(tangent.data(), 5, delta);
    return true;
  }
  bool MinusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 5, kPoseSize, Eigen::RowMajor>> result(jacobian);
    result.setZero();
    result.leftCols<6>() = basis(unpack(x)).transpose();
    return true;
  }

 private:
  using Vector5d = Eigen::Matrix<double, 5, 1>;

  Eigen::Matrix<double, 6, 5> basis(const SE3& pose) const {
    const Eigen::HouseholderQR<Vector6d> qr(gauge_.held_direction(pose));
    const Matrix6d q = qr.householderQ();
    return q.rightCols<5>();
  }

  const ScaleGauge& gauge_;
};

class ReprojectionCost : public ceres::SizedCostFunction<2, kPoseSize, 3> {
 public:
  ReprojectionCost(const Reprojector& reprojector, const BundleObservation& seen)
      : reprojector_(reprojector), seen_(seen) {}

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> point(parameters[1]);
    Eigen::Vector2d residual(std::sqrt(kUnseenChi2), 0);
    Matrix26d by_pose = Matrix26d::Zero();
    Matrix23d by_point = Matrix23d::Zero();
    const bool wanted = jacobians != nullptr;
    reprojector_.evaluate(seen_.camera, unpack(parameters[0]), point, seen_.pixel, seen_.sigma,
                          residual, wanted ? &by_pose : nullptr, wanted ? &by_point : nullptr);
    std::copy_n(residual.data(), 2, residuals);
    if (wanted) store(by_pose, by_point, jacobians);
    return true;
  }

 private:
  static void store(const Matrix26d& by_pose, const Matrix23d& by_point, double** jacobians) {
    if (jacobians[0]) {
      Eigen::Map<LiftedJacobian> lifted(jacobians[0]);
      lifted.leftCols<6>() = by_pose;
      lifted.col(6).setZero();
    }
    if (jacobians[1]) {
      Eigen::Map<RowMajor23d> block(jacobians[1]);
      block = by_point;
    }
  }

  const Reprojector& reprojector_;
  const BundleObservation& seen_;
};

// HuberKernel in Ceres' terms. The second derivative is left out on purpose: for a concave kernel
// Ceres does not use it either.
class KernelLoss : public ceres::LossFunction {
 public:
  explicit KernelLoss(double threshold) : kernel_{threshold} {}
  void Evaluate(double s, double* rho) const override {
    rho[0] = kernel_.rho(s);
    rho[1] = kernel_.weight(s);
    rho[2] = 0;
  }

 private:
  HuberKernel kernel_;
};

// Asks whether to stop after each iteration.
class StopCallback : public ceres::IterationCallback {
 public:
  explicit StopCallback(const std::function<bool()>& should_stop) : should_stop_(should_stop) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    const bool stop = summary.iteration > 0 && should_stop_ && should_stop_();
    return stop ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const std::function<bool()>& should_stop_;
};

// A Ceres problem over copies of the poses; the points are changed in place.
class CeresBundle {
 public:
  CeresBundle(BundleProblem& bundle, const BundlePass& pass)
      : bundle_(bundle),
        pass_(pass),
        reprojector_(bundle.rig),
        poses_(bundle.world_from_body.size()),
        held_manifold_(pass.gauge),
        loss_(pass.options.huber),
        problem_(borrowing()) {
    for (std::size_t i = 0; i < poses_.size(); ++i)
      pack(bundle.world_from_body[i], poses_[i].data());
    add_observations();
    set_manifolds();
  }

  ceres::Solver::Summary solve() {
    StopCallback stop(pass_.options.should_stop);
    ceres::Solver::Options options = solver_options();
    options.callbacks.push_back(&stop);
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary;
  }

  void store_poses() {
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      if (!bundle_.pose_fixed[i]) bundle_.world_from_body[i] = unpack(poses_[i].data());
    }
  }

 private:
  static ceres::Problem::Options borrowing() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  void add_observations() {
    for (std::size_t i = 0; i < bundle_.observations.size(); ++i) {
      if (!pass_.active[i]) continue;
      const BundleObservation& seen = bundle_.observations[i];
      costs_.emplace_back(reprojector_, seen);
      problem_.AddResidualBlock(&costs_.back(), &loss_, poses_[seen.pose].data(),
                                bundle_.points[seen.point].data());
    }
  }

  void set_manifolds() {
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      double* block = poses_[i].data();
      if (!problem_.HasParameterBlock(block)) continue;
      if (bundle_.pose_fixed[i]) {
        problem_.SetParameterBlockConstant(block);
      } else if (static_cast<int>(i) == pass_.gauge.pose) {
        problem_.SetManifold(block, &held_manifold_);
      } else {
        problem_.SetManifold(block, &manifold_);
      }
    }
  }

  // Points are eliminated first; blocks enter in index order, so the result does not depend on
  // addresses.
  std::shared_ptr<ceres::ParameterBlockOrdering> ordering() {
    auto result = std::make_shared<ceres::ParameterBlockOrdering>();
    for (auto& point : bundle_.points) {
      if (problem_.HasParameterBlock(point.data())) result->AddElementToGroup(point.data(), 0);
    }
    for (auto& pose : poses_) {
      if (problem_.HasParameterBlock(pose.data())) result->AddElementToGroup(pose.data(), 1);
    }
    return result;
  }

  ceres::Solver::Options solver_options() {
    ceres::Solver::Options options;
    options.linear_solver_type =
        poses_.size() <= kDenseSchurPoses ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.linear_solver_ordering = ordering();
    options.max_num_iterations = pass_.max_iterations;
    options.function_tolerance = pass_.options.min_relative_decrease;
    options.num_threads = pass_.options.threads;
    options.logging_type = ceres::SILENT;
    return options;
  }

  BundleProblem& bundle_;
  const BundlePass& pass_;
  Reprojector reprojector_;
  std::vector<PoseBlock> poses_;
  PoseManifold manifold_;
  HeldPoseManifold held_manifold_;
  KernelLoss loss_;
  std::deque<ReprojectionCost> costs_;  // stays where it is while growing
  ceres::Problem problem_;
};

}  // namespace

MinimizationResult minimize_with_ceres(BundleProblem& problem, const BundlePass& pass) {
  CeresBundle bundle(problem, pass);
  const ceres::Solver::Summary summary = bundle.solve();
  bundle.store_poses();
  MinimizationResult result;
  result.iterations = summary.num_successful_steps + summary.num_unsuccessful_steps - 1;
  result.usable = summary.IsSolutionUsable();
  result.stopped = summary.termination_type == ceres::USER_SUCCESS;
  return result;
}

}  // namespace rover
