#include "rover/optimization/camera_imu_calibration.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/imu/simulated_motion.h"
#include "rover/optimization/calibration_model.h"
#include "rover/optimization/simulated_flight.h"

namespace rover {
namespace {

using ::testing::HasSubstr;

constexpr double kInterval = 0.25;
constexpr double kDegree = M_PI / 180;
constexpr double kPositionSigma = 0.002, kAngleSigma = 0.0005;  // of vision's poses
const ImuBias kBias = {{0.02, -0.03, 0.05}, {0.1, -0.05, 0.12}};

struct Simulated {
  SimulatedMotion motion;
  CameraImuCalibration truth;
  CalibrationProblem problem;
};

// Samples as a sensor stamps them whose clock is `late` seconds ahead.
std::vector<ImuSample> flown(const SimulatedMotion& motion, double begin, double end, double late,
                             const ImuNoise& noise, Random& random) {
  auto samples = simulate_imu(motion, begin - late, end - late, 200, kBias, noise, random);
  for (std::size_t k = 0; k < samples.size(); ++k)
    samples[k].time = from_seconds(begin + 0.005 * static_cast<double>(k));
  return samples;
}

Eigen::MatrixXd information_of(std::size_t keyframes) {
  Vector6d one;
  one << Eigen::Vector3d::Constant(kPositionSigma), Eigen::Vector3d::Constant(kAngleSigma);
  Eigen::VectorXd all(6 * static_cast<Eigen::Index>(keyframes - 1));
  for (Eigen::Index i = 0; i < all.size(); ++i) all[i] = 1 / (one[i % 6] * one[i % 6]);
  return all.asDiagonal();
}

Simulated simulate(int keyframes, const SimulatedMotion& motion, double late, const SE3& given,
                   Random& random) {
  Simulated result;
  result.motion = motion;
  result.truth = {late, forward_rig(1).body_from_camera[0]};
  CalibrationProblem& problem = result.problem;
  const ImuNoise noise = simulated_noise(8);
  for (int i = 0; i < keyframes; ++i) {
    const double time = kInterval * i;
    Vector6d error;
    error << kPositionSigma * random_gaussian_vector(random),
        kAngleSigma * random_gaussian_vector(random);
    if (i == 0) error.setZero();
    problem.world_from_camera.push_back(
        se3_plus(motion.pose(time) * result.truth.body_from_camera, error));
    problem.velocity.push_back(motion.state(time).velocity + 0.1 * random_gaussian_vector(random));
    if (i + 1 == keyframes) break;
    problem.motions.emplace_back(flown(motion, time, time + kInterval, late, noise, random),
                                 ImuBias{}, noise);
  }
  const double end = kInterval * (keyframes - 1);
  problem.after = flown(motion, end, end + 0.1, late, noise, random);
  problem.information = information_of(problem.world_from_camera.size());
  problem.now = problem.given = {0, given};
  return result;
}

// Disturbed as the priors say.
SE3 disturbed_extrinsics(const CalibrationOptions& options, Random& random) {
  Vector6d error;
  error << options.prior_translation * random_gaussian_vector(random),
      options.prior_rotation * random_gaussian_vector(random);
  return se3_plus(forward_rig(1).body_from_camera[0], error);
}

CalibrationState disturbed_state(const Simulated& simulated, Random& random) {
  CalibrationState state;
  state.time_offset = 0.004;
  state.body_from_camera = simulated.problem.now.body_from_camera;
  state.world_from_aligned = so3_exp({0.01, -0.02, 0});
  state.bias = {0.01 * random_gaussian_vector(random), 0.1 * random_gaussian_vector(random)};
  state.world_from_camera = simulated.problem.world_from_camera;
  state.velocity = simulated.problem.velocity;
  return state;
}

TEST(CameraImuCalibration, CarriesStatesWithRightJacobians) {
  Random random(1);
  const Reading reading = {{0.4, -0.7, 0.3}, {1, -2, 0.5}};
  InertialState state = {random_pose(random, 2), {0.5, 1, -0.3}, kBias};
  constexpr double kTime = 0.03, kStep = 1e-6;
  Matrix15d by_state;
  Vector15d by_time;
  const InertialState to = carried(state, reading, kTime, &by_state, &by_time);
  const Vector15d numeric = state_minus(carried(state, reading, kTime + kStep), to) / kStep;
  EXPECT_LT((numeric - by_time).norm(), 1e-4);
  for (int k = 0; k < 15; ++k) {
    Vector15d step = Vector15d::Zero();
    step[k] = kStep;
    const Vector15d column =
        state_minus(carried(state_plus(state, step), reading, kTime), to) / kStep;
    EXPECT_LT((column - by_state.col(k)).norm(), 1e-4) << k;
  }
}

TEST(CameraImuCalibration, BodyFollowsTheCamera) {
  Random random(2);
  const SE3 world_from_camera = random_pose(random, 2), body_from_camera = random_pose(random, 0.3);
  const SE3 body = world_from_camera * body_from_camera.inverse();
  for (int k = 0; k < 6; ++k) {
    Vector6d step = Vector6d::Zero();
    step[k] = 1e-6;
    const Vector6d analytic = body_by_camera(body_from_camera).col(k);
    const SE3 by_camera = se3_plus(world_from_camera, step) * body_from_camera.inverse();
    EXPECT_LT((se3_minus(by_camera, body) / 1e-6 - analytic).norm(), 1e-5) << k;
    const SE3 by_rig = world_from_camera * se3_plus(body_from_camera, step).inverse();
    EXPECT_LT((se3_minus(by_rig, body) / 1e-6 + analytic).norm(), 1e-5) << k;
  }
}

// The gradient of the whole cost against differences of the cost.
TEST(CameraImuCalibration, GradientIsThatOfTheCost) {
  Random random(3);
  const CalibrationOptions options = {.time_offset = true, .extrinsics = true};
  const auto simulated = simulate(4, SimulatedMotion::random(random), 0.004,
                                  disturbed_extrinsics(options, random), random);
  const std::vector<Reading> readings(4, {{0.4, -0.7, 0.3}, {1, -2, 0.5}});
  CalibrationModel model(simulated.problem, options, simulated.problem.motions, readings, 0.001);
  const CalibrationState state = disturbed_state(simulated, random);
  DenseEquations equations, above, below;
  model.linearize(state, equations);
  const double largest = equations.gradient.cwiseAbs().maxCoeff();
  for (Eigen::Index k = 0; k < equations.gradient.size(); ++k) {
    if (k >= CalibrationModel::kStates && k < CalibrationModel::kStates + 6) continue;  // held
    constexpr double kStep = 1e-6;
    DenseStep step{Eigen::VectorXd::Zero(equations.gradient.size()), 0};
    CalibrationState moved;
    step.delta[k] = kStep;
    model.move(state, step, moved);
    model.linearize(moved, above);
    step.delta[k] = -kStep;
    model.move(state, step, moved);
    model.linearize(moved, below);
    const double numeric = (above.cost - below.cost) / (2 * kStep);
    EXPECT_NEAR(numeric, equations.gradient[k], 1e-5 * largest + 1e-3 * std::abs(numeric)) << k;
  }
}

// Mean squares of errors over their stated deviations: 1 where these are honest.
struct Honesty {
  double time = 0, rotation = 0, translation = 0;
  int count = 0;

  void add(const CalibrationResult& result, const CameraImuCalibration& truth) {
    const Vector6d error = se3_minus(result.calibration.body_from_camera, truth.body_from_camera);
    const double late = (result.calibration.time_offset - truth.time_offset) / result.time_sigma;
    const Eigen::Vector3d moved = error.head<3>().cwiseQuotient(result.translation_sigma);
    const Eigen::Vector3d turned = error.tail<3>().cwiseQuotient(result.rotation_sigma);
    EXPECT_LT(std::abs(late), 4.5);
    EXPECT_LT(moved.cwiseAbs().maxCoeff(), 4.5);
    EXPECT_LT(turned.cwiseAbs().maxCoeff(), 4.5);
    time += late * late;
    translation += moved.squaredNorm() / 3;
    rotation += turned.squaredNorm() / 3;
    ++count;
  }
};

TEST(CameraImuCalibration, FindsOffsetAndExtrinsicsWithinStatedSigmas) {
  Random random(4);
  const CalibrationOptions options = {.time_offset = true, .extrinsics = true};
  Honesty honesty;
  for (int i = 0; i < 40; ++i) {
    const double late = options.prior_time_offset * random.gaussian();
    const auto simulated = simulate(40, SimulatedMotion::random(random), late,
                                    disturbed_extrinsics(options, random), random);
    const auto result = calibrate_camera_imu(simulated.problem, options);
    ASSERT_TRUE(result.accepted) << result.missing;
    EXPECT_TRUE(result.significant);
    EXPECT_LT(result.time_sigma, 0.0015);
    EXPECT_LT(result.rotation_sigma.maxCoeff(), 0.2 * kDegree);
    EXPECT_LT(result.translation_sigma.maxCoeff(), options.prior_translation);
    honesty.add(result, simulated.truth);
  }
  EXPECT_GT(honesty.time / honesty.count, 0.5);
  EXPECT_LT(honesty.time / honesty.count, 1.6);
  EXPECT_GT(honesty.rotation / honesty.count, 0.5);
  EXPECT_LT(honesty.rotation / honesty.count, 1.6);
  EXPECT_GT(honesty.translation / honesty.count, 0.5);
  EXPECT_LT(honesty.translation / honesty.count, 1.6);
}

// Monocular vision does not know the scale.
TEST(CameraImuCalibration, FindsTheOffsetWhileTheScaleIsOff) {
  Random random(5);
  const CalibrationOptions options = {.time_offset = true};
  for (int i = 0; i < 10; ++i) {
    auto simulated = simulate(40, SimulatedMotion::random(random), 0.012,
                              forward_rig(1).body_from_camera[0], random);
    CalibrationProblem& problem = simulated.problem;
    const Eigen::Vector3d origin = problem.world_from_camera[0].translation;
    Eigen::VectorXd scale = Eigen::VectorXd::Zero(problem.information.rows());
    for (std::size_t k = 1; k < problem.world_from_camera.size(); ++k) {
      SE3& pose = problem.world_from_camera[k];
      pose.translation = origin + 1.04 * (pose.translation - origin);
      scale.segment<3>(static_cast<Eigen::Index>(6 * (k - 1))) =
          pose.rotation.conjugate() * (pose.translation - origin);
    }
    const Eigen::VectorXd known = problem.information * scale;
    problem.information -= known * known.transpose() / scale.dot(known);
    const auto result = calibrate_camera_imu(problem, options);
    ASSERT_TRUE(result.accepted) << result.missing;
    EXPECT_NEAR(result.calibration.time_offset, 0.012, 4 * result.time_sigma);
    EXPECT_LT(result.time_sigma, 0.0015);
    EXPECT_EQ(result.rotation_sigma.norm(), 0);
    EXPECT_LT(se3_minus(result.calibration.body_from_camera, problem.now.body_from_camera).norm(),
              1e-12);
  }
}

TEST(CameraImuCalibration, LeavesARightCalibrationAlone) {
  Random random(6);
  const CalibrationOptions options = {.time_offset = true, .extrinsics = true};
  int changes = 0;
  for (int i = 0; i < 20; ++i) {
    const auto simulated = simulate(40, SimulatedMotion::random(random), 0,
                                    forward_rig(1).body_from_camera[0], random);
    const auto result = calibrate_camera_imu(simulated.problem, options);
    EXPECT_TRUE(result.accepted) << result.missing;
    changes += result.significant;
  }
  EXPECT_LE(changes, 2);
}

TEST(CameraImuCalibration, SaysWhatIsMissing) {
  Random random(7);
  const CalibrationOptions options = {.time_offset = true, .extrinsics = true};
  SimulatedMotion straight = SimulatedMotion::random(random);
  for (auto& wave : straight.angles) wave.amplitude = 0;
  const SE3 given = forward_rig(1).body_from_camera[0];
  const auto unturned =
      calibrate_camera_imu(simulate(25, straight, 0, given, random).problem, options);
  EXPECT_FALSE(unturned.accepted);
  EXPECT_FALSE(unturned.significant);
  EXPECT_THAT(unturned.missing, HasSubstr("needs rotation about two axes"));
  SimulatedMotion still = straight;
  for (auto& wave : still.position) wave.amplitude = 0;
  const auto resting = calibrate_camera_imu(simulate(25, still, 0, given, random).problem, options);
  EXPECT_FALSE(resting.accepted);
  EXPECT_THAT(resting.missing, HasSubstr("needs rotation"));
  const auto shortly = calibrate_camera_imu(
      simulate(5, SimulatedMotion::random(random), 0, given, random).problem, options);
  EXPECT_FALSE(shortly.solved);
  EXPECT_THAT(shortly.missing, HasSubstr("needs time"));
}

TEST(CameraImuCalibration, ChecksItsInput) {
  Random random(8);
  auto problem = simulate(12, SimulatedMotion::random(random), 0, SE3(), random).problem;
  EXPECT_THROW(calibrate_camera_imu(problem, {.prior_rotation = 0}), InputError);
  EXPECT_THROW(calibrate_camera_imu(problem, {.max_time_sigma = -1}), InputError);
  problem.velocity.pop_back();
  EXPECT_THROW(calibrate_camera_imu(problem, {}), std::invalid_argument);
}

}  // namespace
}  // namespace rover
