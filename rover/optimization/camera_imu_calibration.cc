#include "rover/optimization/camera_imu_calibration.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "rover/base/error.h"
#include "rover/imu/clock_shift.h"
#include "rover/optimization/calibration_model.h"
#include "rover/optimization/inertial_alignment.h"
#include "rover/optimization/levenberg_marquardt.h"

namespace rover {
namespace {

constexpr int kRounds = 4;                      // of cutting the motions anew
constexpr Timestamp kReadingHalf = 10'000'000;  // ns around a stamp that its reading is the mean of
constexpr std::size_t kMinMotions = 8;

void check_problem(const CalibrationProblem& problem) {
  const std::size_t keyframes = problem.world_from_camera.size();
  const auto unknowns = keyframes == 0 ? 0 : 6 * static_cast<Eigen::Index>(keyframes - 1);
  if (keyframes < 2 || problem.motions.size() + 1 != keyframes ||
      problem.velocity.size() != keyframes || problem.information.rows() != unknowns ||
      problem.information.cols() != unknowns)
    throw std::invalid_argument("calibration: sizes do not fit");
}

CalibrationState start_of(const CalibrationProblem& problem) {
  CalibrationState state;
  state.body_from_camera = problem.now.body_from_camera;
  state.world_from_aligned = world_from_aligned(problem.gravity);
  state.bias = problem.bias;
  state.world_from_camera = problem.world_from_camera;
  state.velocity = problem.velocity;
  return state;
}

// The mean of the readings close to a keyframe's stamp, without noise of the single one.
ImuSample reading_near(const std::vector<Preintegration>& motions, std::size_t keyframe) {
  const Timestamp time =
      keyframe < motions.size() ? motions[keyframe].begin() : motions.back().end();
  ImuSample mean{.time = time};
  double count = 0;
  for (std::size_t i = keyframe - std::min<std::size_t>(keyframe, 1);
       i < std::min(keyframe + 1, motions.size()); ++i) {
    for (const ImuSample& sample : motions[i].samples()) {
      if (std::abs(sample.time - time) > kReadingHalf) continue;
      mean.angular_velocity += sample.angular_velocity;
      mean.acceleration += sample.acceleration;
      ++count;
    }
  }
  mean.angular_velocity /= count;
  mean.acceleration /= count;
  return mean;
}

std::vector<Reading> readings_of(const std::vector<Preintegration>& motions,
                                 const CalibrationState& state) {
  std::vector<Reading> readings;
  for (std::size_t i = 0; i < state.velocity.size(); ++i) {
    const ImuSample mean = reading_near(motions, i);
    const Eigen::Vector3d force = mean.acceleration - state.bias.accelerometer;
    readings.push_back({mean.angular_velocity - state.bias.gyroscope,
                        state.body(i).world_from_body.rotation * force + state.gravity()});
  }
  return readings;
}

// The most probable state, and the equations there.
struct Solution {
  bool usable = false;
  double offset = 0;  // s
  CalibrationState state;
  DenseEquations equations{};
};

CalibrationModel cut_model(const CalibrationProblem& problem, const CalibrationOptions& options,
                           const CalibrationState& state, double offset) {
  auto motions = with_shifted_clock(problem.motions, problem.after, from_seconds(offset));
  for (Preintegration& motion : motions) motion.reintegrate(state.bias);
  auto readings = readings_of(motions, state);
  return {problem, options, std::move(motions), std::move(readings), offset};
}

// From round to round the motions are cut for the offset found, and integrated with the biases.
Solution solve(const CalibrationProblem& problem, const CalibrationOptions& options, bool hold) {
  Solution solution{.offset = problem.now.time_offset, .state = start_of(problem)};
  for (int round = 0; round < kRounds; ++round) {
    CalibrationModel model = cut_model(problem, options, solution.state, solution.offset);
    if (hold) model.hold_calibration();
    if (round > 0) model.make_robust();
    LevenbergMarquardt<CalibrationModel> solver(model, solution.state);
    const auto result = solver.run({.iterations = options.iterations, .absolute_decrease = 1e-4});
    if (!result.usable) return solution;
    solution.state = solver.state();
    solution.offset += std::exchange(solution.state.time_offset, 0);
  }
  CalibrationModel model = cut_model(problem, options, solution.state, solution.offset);
  if (hold) model.hold_calibration();
  model.make_robust();
  model.linearize(solution.state, solution.equations);
  solution.usable = std::isfinite(solution.equations.cost);
  return solution;
}

// False where the solution is not determined.
bool add_statistics(const CalibrationProblem& problem, const CalibrationOptions& options,
                    const Solution& solution, double cost_before, CalibrationResult& result) {
  const Eigen::MatrixXd covariance =
      inverse_of(solution.equations.hessian.selfadjointView<Eigen::Lower>());
  if (covariance.rows() == 0) return false;
  // Each motion gives 9 equations and takes 3 velocities; poses take what vision gives.
  const double freedom = 6 * static_cast<double>(problem.motions.size()) - 6;
  result.chi2_ratio = 2 * solution.equations.cost / freedom;
  const double factor = std::max(1.0, result.chi2_ratio);
  result.chi2_gain = 2 * (cost_before - solution.equations.cost) / factor;
  const Eigen::VectorXd sigma =
      (factor * covariance.diagonal().head(CalibrationModel::kGravity)).cwiseSqrt();
  if (options.time_offset) result.time_sigma = sigma[CalibrationModel::kOffset];
  if (!options.extrinsics) return true;
  result.translation_sigma = sigma.segment<3>(CalibrationModel::kExtrinsics);
  result.rotation_sigma = sigma.segment<3>(CalibrationModel::kExtrinsics + 3);
  return true;
}

std::string what_is_missing(const CalibrationResult& result, const CalibrationOptions& options) {
  constexpr double kDegree = M_PI / 180;
  const double rotation = result.rotation_sigma.maxCoeff();
  if (result.chi2_ratio > options.max_chi2_ratio) {
    return fmt::format(
        "camera and inertial sensor contradict each other (chi-square {:.1f} per degree of "
        "freedom), whatever the calibration",
        result.chi2_ratio);
  }
  if (result.time_sigma > options.max_time_sigma) {
    return fmt::format("the clock's offset is known to {:.1f} ms ({:.1f} needed): needs rotation",
                       1e3 * result.time_sigma, 1e3 * options.max_time_sigma);
  }
  if (rotation > options.max_rotation_sigma) {
    return fmt::format(
        "the camera's rotation is known to {:.2f} degrees ({:.2f} needed): needs rotation about "
        "two axes",
        rotation / kDegree, options.max_rotation_sigma / kDegree);
  }
  return "";
}

// The 99% points of chi-square with 1, 6 and 7 degrees of freedom are 6.6, 16.8 and 18.5.
double chance(int unknowns) { return 4.6 + 2 * unknowns; }

}  // namespace

void CalibrationOptions::check() const {
  require(prior_time_offset > 0 && prior_rotation > 0 && prior_translation > 0,
          "calibration: prior sigmas must be positive, not {}, {} and {}", prior_time_offset,
          prior_rotation, prior_translation);
  require(max_time_sigma > 0 && max_rotation_sigma > 0 && max_chi2_ratio > 0,
          "calibration: limits must be positive, not {}, {} and {}", max_time_sigma,
          max_rotation_sigma, max_chi2_ratio);
  require(gyroscope_bias_sigma > 0 && accelerometer_bias_sigma > 0,
          "calibration: bias sigmas must be positive, not {} and {}", gyroscope_bias_sigma,
          accelerometer_bias_sigma);
  require(huber > 0 && iterations > 0,
          "calibration: huber and iterations must be positive, not {} and {}", huber, iterations);
}

CalibrationResult calibrate_camera_imu(const CalibrationProblem& problem,
                                       const CalibrationOptions& options) {
  options.check();
  check_problem(problem);
  CalibrationResult result;
  result.calibration = problem.now;
  result.missing = "needs time: too few keyframes are linked by inertial data";
  if (problem.motions.size() < kMinMotions) return result;
  result.missing = "motion does not determine the calibration: needs rotation and acceleration";
  const Solution before = solve(problem, options, true);
  const Solution solution = solve(problem, options, false);
  if (!before.usable || !solution.usable ||
      !add_statistics(problem, options, solution, before.equations.cost, result))
    return result;
  result.solved = true;
  result.calibration = {solution.offset, solution.state.body_from_camera};
  result.missing = what_is_missing(result, options);
  result.accepted = result.missing.empty();
  result.significant = result.accepted && result.chi2_gain > chance(options.unknowns());
  return result;
}

}  // namespace rover
