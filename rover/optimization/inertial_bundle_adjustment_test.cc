#include "rover/optimization/inertial_bundle_adjustment.h"

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "rover/base/error.h"
#include "rover/base/stopwatch.h"
#include "rover/optimization/inertial_model.h"
#include "rover/optimization/simulated_flight.h"

namespace rover {
namespace {

void add_bias_prior(InertialBundleProblem& problem, double gyroscope, double accelerometer) {
  problem.priors.push_back({0, bias_prior({}, gyroscope, accelerometer)});
}

InertialBundleOptions without_outlier_rule() {
  InertialBundleOptions options;
  options.bundle.chi2 = 1e6;
  options.bundle.huber = 1e3;
  options.bundle.min_relative_decrease = 1e-9;
  options.covariance = true;
  return options;
}

TEST(InertialBundle, FindsTheTrueStates) {
  for (const int cameras : {1, 2}) {
    const auto flight = simulate_flight({.cameras = cameras, .seed = 2});
    Random random(3);
    auto problem = disturbed(flight, 1, random);
    const double before = position_error(problem.bundle, flight.truth.bundle);
    const auto summary = adjust_inertial_bundle(problem, {});
    ASSERT_TRUE(summary.visual.usable);
    EXPECT_GT(before, 0.03);
    EXPECT_LT(position_error(problem.bundle, flight.truth.bundle), 0.01);
    for (std::size_t i = 0; i < problem.velocity.size(); ++i)
      EXPECT_LT((problem.velocity[i] - flight.truth.velocity[i]).norm(), 0.03);
    EXPECT_LT((problem.bias[5].gyroscope - flight.truth.bias[5].gyroscope).norm(), 0.002);
    for (const double chi2 : summary.link_chi2) EXPECT_LT(chi2, 40);
  }
}

TEST(InertialBundle, RecoversTheScaleOfAMonocularMap) {
  for (const double scale : {0.7, 0.9, 1.15, 1.4}) {
    const auto flight = simulate_flight({.keyframes = 16, .seed = 4});
    Random random(5);
    auto problem = disturbed(flight, 0.3, random);
    const Eigen::Vector3d origin = problem.bundle.world_from_body[0].translation;
    const SE3 body_from_camera = problem.bundle.rig.body_from_camera[0];
    for (SE3& pose : problem.bundle.world_from_body) {
      SE3 camera = pose * body_from_camera;
      camera.translation = origin + scale * (camera.translation - origin);
      pose = camera * body_from_camera.inverse();
    }
    for (auto& point : problem.bundle.points) point = origin + scale * (point - origin);
    InertialBundleOptions options;
    options.bundle.first_iterations = 15;
    options.covariance = true;
    const auto summary = adjust_inertial_bundle(problem, options);
    ASSERT_TRUE(summary.visual.usable);
    const auto length = [](const BundleProblem& bundle) {
      return (bundle.world_from_body.back().translation - bundle.world_from_body[0].translation)
          .norm();
    };
    const double error = std::abs(length(problem.bundle) / length(flight.truth.bundle) - 1);
    EXPECT_LT(error, 0.02);
    EXPECT_GT(summary.scale_sigma, 0);
    EXPECT_LT(summary.scale_sigma, 0.02);
  }
}

TEST(InertialBundle, TellsTheCovarianceOfOneStateAlone) {
  const auto flight = simulate_flight({.cameras = 2, .keyframes = 6, .points = 80});
  for (const int fixed : {0, 2}) {
    for (const int pose : {fixed, 5}) {
      auto problem = flight.truth;
      for (int i = 0; i < fixed; ++i) problem.bundle.pose_fixed[i] = 1;
      InertialBundleOptions options = without_outlier_rule();
      options.covariance_of = pose;
      const auto summary = adjust_inertial_bundle(problem, options);
      ASSERT_TRUE(summary.state_covariance);
      EXPECT_TRUE(summary.state_covariance->isApprox(summary.covariance[pose], 1e-6));
    }
  }
  auto problem = flight.truth;
  EXPECT_THROW(adjust_inertial_bundle(problem, {.covariance_of = 6}), std::invalid_argument);
}

// A window behind a fixed pose whose velocity and biases are free.
InertialBundleProblem window_of(const SimulatedFlight& flight) {
  InertialBundleProblem problem = flight.truth;
  problem.bundle.pose_fixed[0] = 1;
  problem.border = 0;
  problem.velocity[0] += Eigen::Vector3d(0.1, -0.1, 0.05);
  problem.priors.push_back({0, bias_prior({}, 0.1, 0.2)});
  return problem;
}

TEST(InertialBundle, FindsTheMotionOfTheBorder) {
  const SimulatedFlight flight = simulate_flight({.cameras = 2, .keyframes = 8, .seed = 3});
  InertialBundleProblem problem = window_of(flight);
  const auto summary = adjust_inertial_bundle(problem, {});
  ASSERT_TRUE(summary.visual.usable);
  EXPECT_LT((problem.velocity[0] - flight.truth.velocity[0]).norm(), 0.02);
  EXPECT_TRUE(problem.bundle.world_from_body[0].translation ==
              flight.truth.bundle.world_from_body[0].translation);
  problem.bundle.pose_fixed[0] = 0;
  EXPECT_THROW(adjust_inertial_bundle(problem, {}), std::invalid_argument);
}

// A map that is tilted is one in which gravity is.
TEST(InertialBundle, TellsHowAStateErrsWithTheMap) {
  const SimulatedFlight flight = simulate_flight({.cameras = 2, .keyframes = 8, .seed = 4});
  Matrix15x3d response;
  const auto solve = [&](const Eigen::Vector3d& tilt) {
    InertialBundleProblem problem = window_of(flight);
    problem.gravity = so3_exp(-tilt) * problem.gravity;
    InertialBundleOptions options{.covariance_of = 7};
    options.bundle.huber = options.bundle.chi2 = 1e3;
    response = adjust_inertial_bundle(problem, options).state_response;
    return problem.state(7);
  };
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector3d step = 1e-3 * Eigen::Vector3d::Unit(k);
    const Vector15d numeric = state_minus(solve(step), solve(-step)) / 2e-3;
    EXPECT_GT(numeric.tail<3>().norm(), 1);  // m/s^2 per rad: tilt passes for bias
    EXPECT_LT((numeric - response.col(k)).norm(), 0.02 * numeric.norm()) << k;
  }
}

TEST(InertialBundle, ErrorsAreWithinTheirCovariance) {
  const int runs = 40;
  for (const int cameras : {1, 2}) {
    double sum = 0, scale = 0;
    for (int run = 0; run < runs; ++run) {
      FlightSimulation simulation = {.cameras = cameras, .keyframes = 8, .points = 120};
      simulation.imu_inflation = 10;
      simulation.seed = static_cast<std::uint64_t>(200 + run);
      const auto flight = simulate_flight(simulation);
      Random random(hash_seed(7, simulation.seed));
      auto problem = disturbed(flight, 0.5, random);
      add_bias_prior(problem, simulation.gyroscope_bias, simulation.accelerometer_bias);
      const auto summary = adjust_inertial_bundle(problem, without_outlier_rule());
      ASSERT_EQ(summary.covariance.size(), 8u);
      const Vector15d error = state_minus(flight.truth.state(7), problem.state(7));
      sum += error.dot(summary.covariance[7].ldlt().solve(error)) / runs;
      scale = std::max(scale, summary.scale_sigma);
    }
    std::printf("%d cameras: mean normalised squared error %.2f of 15\n", cameras, sum);
    EXPECT_NEAR(sum, 15, 1.96 * std::sqrt(30.0 / runs));
    EXPECT_LT(scale, 0.3);
  }
}

// How much longer `estimate` is than `truth`, by the similarity that fits best; logarithm.
double scale_error(const BundleProblem& estimate, const BundleProblem& truth) {
  Eigen::Matrix3Xd from(3, truth.world_from_body.size()), to(from);
  for (Eigen::Index i = 0; i < from.cols(); ++i) {
    from.col(i) = truth.world_from_body[static_cast<std::size_t>(i)].translation;
    to.col(i) = estimate.world_from_body[static_cast<std::size_t>(i)].translation;
  }
  return std::log(Eigen::umeyama(from, to).block<3, 1>(0, 0).norm());
}

TEST(InertialBundle, TheScaleIsAsCertainAsItSays) {
  const int runs = 80;
  for (const double inflation : {1.0, 8.0}) {
    double sum = 0, sigma = 0;
    int within = 0;
    for (int run = 0; run < runs; ++run) {
      FlightSimulation simulation = {.points = 100, .imu_inflation = inflation};
      simulation.seed = static_cast<std::uint64_t>(500 + run);
      const auto flight = simulate_flight(simulation);
      Random random(hash_seed(8, simulation.seed));
      auto problem = disturbed(flight, 0.5, random);
      add_bias_prior(problem, simulation.gyroscope_bias, simulation.accelerometer_bias);
      InertialBundleOptions options = without_outlier_rule();
      options.covariance = false;
      options.scale_sigma = true;
      const auto summary = adjust_inertial_bundle(problem, options);
      ASSERT_GT(summary.scale_sigma, 0);
      const double ratio = scale_error(problem.bundle, flight.truth.bundle) / summary.scale_sigma;
      sum += ratio * ratio / runs;
      sigma += summary.scale_sigma / runs;
      within += std::abs(ratio) < 2;
    }
    std::printf(
        "noise x %.0f: mean normalised squared scale error %.2f, %d of %d within 2 sigma of "
        "%.2f%%\n",
        inflation, sum, within, runs, 100 * sigma);
    EXPECT_NEAR(sum, 1, 1.96 * std::sqrt(2.0 / runs) + 0.1);
    EXPECT_GE(within, 0.9 * runs);
  }
}

// The information of the states with the gauge left free, scaled to a unit diagonal.
Eigen::MatrixXd scaled_information(const InertialBundleProblem& problem) {
  const std::vector<char> active(problem.bundle.observations.size(), 1);
  const ScaleGauge gauge;
  const BundleOptions options;
  InertialBundleModel model(problem, {active, gauge, options, 0});
  InertialBundleModel::Equations equations;
  model.linearize(InertialBundleModel::initial(problem), equations);
  const Eigen::MatrixXd information = model.information(equations);
  const Eigen::VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  return scale.asDiagonal() * information * scale.asDiagonal();
}

TEST(InertialBundle, LeavesFourDirectionsFree) {
  for (const int cameras : {1, 2}) {
    const auto flight = simulate_flight({.cameras = cameras, .imu_inflation = 10, .seed = 6});
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scaled_information(flight.truth));
    const Eigen::VectorXd& values = solver.eigenvalues();
    EXPECT_LT(values.head<4>().cwiseAbs().maxCoeff(), 1e-3 * values[4]);
    EXPECT_GT(values[4], 0);
  }
}

TEST(InertialBundle, HoldsTheGaugeOrTheFixedState) {
  auto flight = simulate_flight({.seed = 7});
  Random random(8);
  auto problem = disturbed(flight, 1, random);
  const SE3 first = problem.bundle.world_from_body[0];
  InertialBundleOptions options;
  options.covariance = true;
  auto summary = adjust_inertial_bundle(problem, options);
  const SE3 moved = problem.bundle.world_from_body[0];
  EXPECT_LT((moved.translation - first.translation).norm(), 1e-9);
  const Eigen::Vector3d turn = so3_log(moved.rotation * first.rotation.conjugate());
  EXPECT_GT(turn.head<2>().norm(), 1e-3);  // gravity was found
  EXPECT_LT(std::abs(turn.z()), 0.05 * turn.head<2>().norm());
  EXPECT_LT((summary.covariance[0].topLeftCorner<3, 3>().norm()), 1e-12);

  flight.truth.bundle.pose_fixed[0] = 1;
  problem = disturbed(flight, 1, random);
  summary = adjust_inertial_bundle(problem, options);
  EXPECT_EQ(problem.bundle.world_from_body[0].translation,
            flight.truth.bundle.world_from_body[0].translation);
  EXPECT_EQ(problem.velocity[0], flight.truth.velocity[0]);
  EXPECT_TRUE(summary.covariance[0].isZero());
  EXPECT_LT(position_error(problem.bundle, flight.truth.bundle), 0.01);
}

TEST(InertialBundle, RemovesOutliers) {
  const auto flight = simulate_flight({.cameras = 2, .outliers = 0.1, .seed = 9});
  Random random(10);
  auto problem = disturbed(flight, 0.5, random);
  const auto summary = adjust_inertial_bundle(problem, {});
  ASSERT_TRUE(summary.visual.usable);
  EXPECT_LT(position_error(problem.bundle, flight.truth.bundle), 0.015);
  int wrong = 0, outliers = 0;
  for (std::size_t i = 0; i < flight.is_outlier.size(); ++i) {
    outliers += flight.is_outlier[i];
    wrong += flight.is_outlier[i] && summary.visual.inliers[i];
  }
  EXPECT_LT(wrong, 0.02 * outliers);
}

TEST(InertialBundle, PosesOutsideTheWindowNeedNoInertialData) {
  auto flight = simulate_flight({.seed = 11});
  // The first six keyframes are old ones: fixed, without links, as covisible ones are.
  for (int i = 0; i < 6; ++i) flight.truth.bundle.pose_fixed[i] = 1;
  auto& links = flight.truth.links;
  links.erase(links.begin(), links.begin() + 5);
  Random random(12);
  auto problem = disturbed(flight, 1, random);
  const auto summary = adjust_inertial_bundle(problem, {.covariance = true});
  ASSERT_TRUE(summary.visual.usable);
  EXPECT_FALSE(summary.covariance.empty());
  EXPECT_LT(position_error(problem.bundle, flight.truth.bundle), 0.01);
  // A free pose without any link keeps its velocity.
  links.clear();
  problem = disturbed(flight, 1, random);
  const Eigen::Vector3d velocity = problem.velocity[8];
  ASSERT_TRUE(adjust_inertial_bundle(problem, {}).visual.usable);
  EXPECT_EQ(problem.velocity[8], velocity);
  EXPECT_LT(position_error(problem.bundle, flight.truth.bundle), 0.02);
}

TEST(InertialBundle, StandingStillHoldsTheState) {
  // Hovering with few, far points in one camera: velocities follow from the prior.
  FlightSimulation simulation = {.keyframes = 6, .points = 15, .imu_inflation = 15, .seed = 13};
  auto flight = simulate_flight(simulation);
  const ImuNoise noise = simulated_noise(15);
  SimulatedMotion still;
  Random random(14);
  auto& truth = flight.truth;
  for (auto& link : truth.links)
    link.motion = Preintegration(simulate_imu(still, 0, 0.25, 200, truth.bias[0], noise, random),
                                 ImuBias{}, noise);
  for (std::size_t i = 0; i < truth.velocity.size(); ++i) {
    truth.bundle.world_from_body[i] = {};
    truth.velocity[i].setZero();
  }
  truth.bundle.observations.clear();
  flight.is_outlier.clear();
  internal::observe_all(simulation, random, flight);
  auto problem = disturbed(flight, 0.2, random);
  add_bias_prior(problem, 0.02, 0.1);
  auto held = problem;
  for (int i = 0; i < 6; ++i) held.priors.push_back({i, zero_velocity_prior(0.01)});
  adjust_inertial_bundle(problem, {});
  adjust_inertial_bundle(held, {});
  EXPECT_LT(held.velocity[3].norm(), 0.01);
  EXPECT_LT(position_error(held.bundle, truth.bundle), 0.01);
  EXPECT_LT(position_error(held.bundle, truth.bundle),
            position_error(problem.bundle, truth.bundle));
}

TEST(InertialBundle, ReintegratesWhenBiasesAreFar) {
  const auto flight =
      simulate_flight({.gyroscope_bias = 0.1, .accelerometer_bias = 0.5, .seed = 15});
  Random random(16);
  auto problem = disturbed(flight, 0.5, random);
  adjust_inertial_bundle(problem, {});
  for (const auto& link : problem.links) EXPECT_GT(link.motion.bias().vector().norm(), 0);
  EXPECT_LT((problem.bias[3].gyroscope - flight.truth.bias[3].gyroscope).norm(), 0.002);
  EXPECT_LT(position_error(problem.bundle, flight.truth.bundle), 0.01);
}

TEST(InertialBundle, AdjustsHundredsOfKeyframes) {
  const auto flight = simulate_flight({.keyframes = 200, .interval = 0.5, .points = 100});
  Random random(17);
  auto problem = disturbed(flight, 0.5, random);
  Stopwatch stopwatch;
  const auto summary = adjust_inertial_bundle(problem, {});
  std::printf("200 keyframes, %zu observations: %.0f ms, %d iterations\n",
              problem.bundle.observations.size(), stopwatch.lap_ms(), summary.visual.iterations);
  ASSERT_TRUE(summary.visual.usable);
  EXPECT_LT(position_error(problem.bundle, flight.truth.bundle), 0.01);
}

TEST(InertialBundle, GivesTheSameBytesTwice) {
  const auto flight = simulate_flight({.outliers = 0.05, .seed = 17});
  Random a(18), b(18);
  auto one = disturbed(flight, 1, a), two = disturbed(flight, 1, b);
  adjust_inertial_bundle(one, {});
  adjust_inertial_bundle(two, {});
  for (std::size_t i = 0; i < one.velocity.size(); ++i) {
    EXPECT_EQ(one.velocity[i], two.velocity[i]);
    EXPECT_EQ(one.bundle.world_from_body[i].translation, two.bundle.world_from_body[i].translation);
  }
}

TEST(InertialBundle, RefusesWhatMakesNoSense) {
  const auto flight = simulate_flight({.keyframes = 4, .points = 30, .seed = 19});
  InertialBundleOptions options;
  options.bundle.fix_scale = true;
  auto problem = flight.truth;
  EXPECT_THROW(adjust_inertial_bundle(problem, options), InputError);
  options.bundle = {.first_iterations = 0};
  EXPECT_THROW(adjust_inertial_bundle(problem, options), InputError);
  problem.links[0].to = 4;
  EXPECT_THROW(adjust_inertial_bundle(problem, {}), std::invalid_argument);
  problem = flight.truth;
  problem.velocity.pop_back();
  EXPECT_THROW(adjust_inertial_bundle(problem, {}), std::invalid_argument);
  problem = flight.truth;
  problem.priors.push_back({-1, zero_velocity_prior(1)});
  EXPECT_THROW(adjust_inertial_bundle(problem, {}), std::invalid_argument);
  problem = flight.truth;
  problem.bundle.points[0].setConstant(std::nan(""));
  EXPECT_FALSE(adjust_inertial_bundle(problem, {}).visual.usable);
  EXPECT_EQ(problem.velocity[1], flight.truth.velocity[1]);
}

}  // namespace
}  // namespace rover
