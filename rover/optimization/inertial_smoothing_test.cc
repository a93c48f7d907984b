#include "rover/optimization/inertial_smoothing.h"

#include <gtest/gtest.h>

#include "rover/optimization/inertial_pose_optimization.h"
#include "rover/optimization/simulated_flight.h"

namespace rover {
namespace {

// Three seconds of dead reckoning from a state that is known well, with the truth beside it.
struct Reckoning {
  std::vector<ReckonedStep> steps;
  InertialState end;  // as reckoned
  std::vector<InertialState> truth;
};

Reckoning reckon(std::uint64_t seed) {
  FlightSimulation simulation;
  simulation.keyframes = 61;
  simulation.interval = 0.05;
  simulation.imu_inflation = 10;
  simulation.seed = seed;
  const SimulatedFlight flight = simulate_flight(simulation);
  Reckoning reckoning;
  Vector15d sigma;
  sigma << Vector6d::Constant(0.002), Eigen::Vector3d::Constant(0.02), Vector6d::Constant(0.002);
  Random random(hash_seed(seed, 3));
  Vector15d error;
  for (int k = 0; k < 15; ++k) error[k] = sigma[k] * random.gaussian();
  InertialState state = state_plus(flight.truth.state(0), error);
  Matrix15d information = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  for (const InertialLink& link : flight.truth.links) {
    const auto motion = std::make_shared<const Preintegration>(link.motion);
    reckoning.truth.push_back(flight.truth.state(link.from));
    reckoning.steps.push_back({state, information, motion});
    const InertialPoseProblem problem{flight.truth.bundle.rig, *motion, state, information};
    const auto estimate = optimize_inertial_pose(problem, {});
    state = estimate.current;
    information = estimate.information;
  }
  reckoning.end = state;
  reckoning.truth.push_back(flight.truth.state(60));
  return reckoning;
}

double error_of(const std::vector<InertialState>& states, const Reckoning& reckoning) {
  double sum = 0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    sum += (states[i].world_from_body.translation - reckoning.truth[i].world_from_body.translation)
               .squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(states.size()));
}

TEST(SmoothReckoning, SpreadsWhatTheEndTellsOverTheWay) {
  double before = 0, after = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Reckoning reckoning = reckon(seed);
    std::vector<InertialState> reckoned;
    for (const ReckonedStep& step : reckoning.steps) reckoned.push_back(step.state);
    const auto smoothed = smooth_reckoning(reckoning.steps, reckoning.truth.back());
    ASSERT_EQ(smoothed.size(), reckoned.size());
    before += error_of(reckoned, reckoning);
    after += error_of(smoothed, reckoning);
    const double start =
        (smoothed[0].world_from_body.translation - reckoned[0].world_from_body.translation).norm();
    EXPECT_LT(start, 0.006);  // three of its deviations
    const double last = (smoothed.back().world_from_body.translation -
                         reckoning.truth[59].world_from_body.translation)
                            .norm();
    EXPECT_LT(last, 0.01);
  }
  EXPECT_LT(after, 0.4 * before);
}

TEST(SmoothReckoning, LeavesWhatFitsAsItWas) {
  const Reckoning reckoning = reckon(1);
  const auto smoothed = smooth_reckoning(reckoning.steps, reckoning.end);
  for (std::size_t i = 0; i < smoothed.size(); ++i) {
    EXPECT_LT(state_minus(smoothed[i], reckoning.steps[i].state).norm(), 1e-6) << i;
  }
}

// A state half way over a second whose ends are known.
struct Middle {
  SimulatedFlight flight;
  InertialState from, to, truth;
  const Preintegration& before;
  const Preintegration& after;

  explicit Middle(std::uint64_t seed)
      : flight(
            simulate_flight({.keyframes = 3, .interval = 0.5, .imu_inflation = 10, .seed = seed})),
        from(flight.truth.state(0)),
        to(flight.truth.state(2)),
        truth(flight.truth.state(1)),
        before(flight.truth.links[0].motion),
        after(flight.truth.links[1].motion) {}

  double error(const InertialState& state) const {
    return (state.world_from_body.translation - truth.world_from_body.translation).norm();
  }
};

TEST(StateBetween, IsBetterKnownThanFromOneSide) {
  double one_side = 0, between = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const Middle middle(seed);
    const auto state = state_between({middle.from, middle.before}, {middle.to, middle.after}, {});
    ASSERT_TRUE(state);
    one_side += middle.error(middle.before.predict(middle.from, gravity_of_z_up()));
    between += middle.error(*state);
  }
  EXPECT_LT(between, 0.5 * one_side);  // of a path of white acceleration: a quarter
}

TEST(StateBetween, TakesInWhatElseIsKnown) {
  const Middle middle(1);
  SE3 seen = middle.truth.world_from_body;
  seen.translation += Eigen::Vector3d(0.1, 0, 0);
  const auto at = [&](double sigma) {
    const auto state = state_between({middle.from, middle.before}, {middle.to, middle.after},
                                     pose_prior(seen, sigma, sigma));
    return (state->world_from_body.translation - seen.translation).norm();
  };
  EXPECT_LT(at(1e-5), 1e-3);
  EXPECT_GT(at(1), 0.09);
}

TEST(SmoothReckoning, OfNothingIsNothing) {
  EXPECT_TRUE(smooth_reckoning({}, InertialState()).empty());
}

}  // namespace
}  // namespace rover
