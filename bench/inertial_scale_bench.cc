// What scale real inertial data tell of a flight, were its poses known exactly, but for their
// scale, at keyframes so far apart: how far apart keyframes may be is decided by it
// (docs/inertial.md). Unknown are scale, gravity's direction, velocities, and biases that walk.
//
//   rover_inertial_scale_bench GROUND_TRUTH INERTIAL_DATA --start 2 --duration 20
//
// Prints one Markdown row for the gaps between keyframes: error of the scale (standard deviation
// stated), per cent.

#include <CLI/CLI.hpp>

#include <cmath>
#include <iostream>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "bench/command_line.h"
#include "rover/datasets/imu_file.h"
#include "rover/imu/imu_buffer.h"
#include "rover/optimization/imu_factor.h"
#include "rover/simulation/motion_fit.h"

namespace rover {
namespace {

constexpr int kCommon = 3;  // logarithm of the scale, tilt about two axes
constexpr int kPerState = 9;
constexpr int kIterations = 4;

struct Scale {
  double error = 0, sigma = 0;  // relative
};

class Flight {
 public:
  Flight(const FittedMotion& fit, const std::vector<ImuSample>& imu, double gap) {
    const ImuRecording recording = real_imu(fit, imu, fit.origin);
    ImuBuffer buffer;
    for (const ImuSample& sample : recording.samples) buffer.add(sample);
    const ImuNoise noise = ImuNoise::of(euroc_imu_calibration(), {});
    const ImuBias bias = recording.biases.front();
    constexpr double kMargin = 0.05;  // s, so that inertial data reach beyond both ends
    Timestamp last = 0;
    for (double t = kMargin; t <= fit.motion.end() - kMargin; t += gap) {
      const MotionState true_state = fit.motion.at(t);
      const Timestamp time = fit.origin + from_seconds(t);
      if (!states_.empty()) links_.emplace_back(buffer.between(last, time), bias, noise);
      states_.push_back({true_state.world_from_body, true_state.velocity, bias});
      last = time;
    }
  }

  Scale solve() {
    for (int i = 0; i < kIterations; ++i) iterate();
    return {std::expm1(log_scale_), sigma_};
  }

 private:
  void iterate() {
    DenseEquations equations;
    equations.reset(kCommon + kPerState * static_cast<int>(states_.size()));
    for (std::size_t i = 0; i < links_.size(); ++i) add(i, equations);
    const Eigen::LDLT<Eigen::MatrixXd, Eigen::Lower> factor(equations.hessian);
    const Eigen::VectorXd step = -factor.solve(equations.gradient);
    const Eigen::Index unknowns = step.size();
    sigma_ = std::sqrt(factor.solve(Eigen::VectorXd::Unit(unknowns, 0))[0]);
    apply(step);
  }

  void add(std::size_t link, DenseEquations& equations) const {
    const InertialState &from = states_[link], &to = states_[link + 1];
    ImuJacobians by;
    const Vector15d residual = imu_residual(links_[link], from, to, gravity_, &by);
    const auto growth = [](const InertialState& state) -> Eigen::Vector3d {
      return state.world_from_body.rotation.conjugate() * state.world_from_body.translation;
    };
    Eigen::Matrix<double, 15, kCommon> common;
    common << by.by_from.leftCols<3>() * growth(from) + by.by_to.leftCols<3>() * growth(to),
        kGravity * by.by_gravity.leftCols<2>();
    Eigen::Matrix<double, 15, 2 * kPerState> own;
    own << by.by_from.rightCols<kPerState>(), by.by_to.rightCols<kPerState>();
    equations.add(residual, common, 0, own, kCommon + kPerState * static_cast<int>(link));
  }

  void apply(const Eigen::VectorXd& step) {
    log_scale_ += step[0];
    gravity_.head<2>() += kGravity * step.segment<2>(1);
    gravity_ *= kGravity / gravity_.norm();
    for (std::size_t i = 0; i < states_.size(); ++i) {
      InertialState& state = states_[i];
      state.world_from_body.translation *= std::exp(step[0]);
      Vector15d own = Vector15d::Zero();
      own.tail<kPerState>() =
          step.segment<kPerState>(kCommon + kPerState * static_cast<Eigen::Index>(i));
      state = state_plus(state, own);
    }
    for (std::size_t i = 0; i < links_.size(); ++i) {
      if (links_[i].is_far(states_[i].bias)) links_[i].reintegrate(states_[i].bias);
    }
  }

  std::vector<InertialState> states_;
  std::vector<Preintegration> links_;
  Eigen::Vector3d gravity_ = gravity_of_z_up();
  double log_scale_ = 0, sigma_ = 0;
};

void run(const std::string& ground_truth, const std::string& inertial,
         const MotionFitOptions& options) {
  require(options.duration >= 10, "--duration is {} s; the scale takes 10 s or more",
          options.duration);
  const std::vector<ImuSample> imu = read_imu_file(inertial);
  const FittedMotion fit = fit_motion(read_trajectory(ground_truth), imu, options);
  std::string header = "|", rule = "|", row = "|";
  for (const double gap : {0.15, 0.25, 0.35, 0.5, 1.0}) {
    const Scale scale = Flight(fit, imu, gap).solve();
    header += fmt::format(" {:g} s |", gap);
    rule += "---|";
    row += fmt::format(" {:+.2f} ({:.2f}) |", 100 * scale.error, 100 * scale.sigma);
  }
  std::cout << header << '\n' << rule << '\n' << row << '\n';
}

}  // namespace
}  // namespace rover

int main(int argc, char** argv) {
  CLI::App program("What scale real inertial data tell, by how far keyframes are apart");
  std::string ground_truth, inertial;
  rover::MotionFitOptions options;
  options.duration = 20;
  program.add_option("ground-truth", ground_truth, "poses of the inertial sensor")->required();
  program.add_option("inertial-data", inertial, "EuRoC data.csv")->required();
  program.add_option("--start", options.start, "s after the first pose");
  program.add_option("--duration", options.duration, "s, default 20");
  return rover::parse_and_run(program, argc, argv,
                              [&] { rover::run(ground_truth, inertial, options); });
}
