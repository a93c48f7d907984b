#include "rover/optimization/inertial_initialization.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/imu/real_flights.h"
#include "rover/imu/simulated_motion.h"
#include "rover/optimization/simulated_flight.h"

namespace rover {
namespace {

using ::testing::HasSubstr;

constexpr Timestamp kClipBegin = 1403715285262142976;

const ImuBias kBias = {{0.02, -0.03, 0.05}, {0.1, -0.05, 0.12}};

// A visual map of a flight: turned anywhere, of any scale, with noisy poses.
struct Simulated {
  SimulatedMotion motion;
  SE3 visual_from_world;
  double scale = 1;  // metres per unit of the map
  InitializationProblem problem;
};

Simulated simulate(int keyframes, double scale, double pose_noise, Random& random) {
  Simulated result;
  result.motion = SimulatedMotion::random(random);
  result.visual_from_world = random_pose(random, 3);
  result.scale = scale;
  InitializationProblem& problem = result.problem;
  problem.body_from_camera = forward_rig(1).body_from_camera[0];
  problem.metric = scale == 1;
  const ImuNoise noise = simulated_noise(10);
  for (int i = 0; i < keyframes; ++i) {
    SE3 pose = result.visual_from_world * result.motion.pose(0.25 * i) * problem.body_from_camera;
    pose.translation += pose_noise * random_gaussian_vector(random);
    pose.rotation = pose.rotation * so3_exp(0.2 * pose_noise * random_gaussian_vector(random));
    pose.translation /= scale;
    problem.world_from_camera.push_back(pose);
    if (i + 1 == keyframes) break;
    problem.motions.emplace_back(
        simulate_imu(result.motion, 0.25 * i, 0.25 * (i + 1), 200, kBias, noise, random), ImuBias{},
        noise);
  }
  return result;
}

double gravity_error(const Simulated& simulated, const InitializationResult& result) {
  const Eigen::Vector3d up = result.aligned_from_world.rotation *
                             (simulated.visual_from_world.rotation * Eigen::Vector3d::UnitZ());
  return std::acos(std::min(1.0, up.z()));
}

TEST(InertialInitialization, FindsScaleGravityAndBiases) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const double scale = std::exp(random.uniform(-2, 2));
    const auto simulated = simulate(20, scale, 0.001, random);
    const auto result = initialize_inertial(simulated.problem, {});
    ASSERT_TRUE(result.solved) << result.missing;
    EXPECT_TRUE(result.accepted) << result.missing;
    EXPECT_TRUE(result.missing.empty());
    EXPECT_NEAR(result.aligned_from_world.scale / scale, 1, 0.05);
    EXPECT_LT(gravity_error(simulated, result), 0.02);
    EXPECT_LT((result.states[0].bias.gyroscope - kBias.gyroscope).norm(), 0.005);
    EXPECT_LT((result.states[0].bias.accelerometer - kBias.accelerometer).norm(), 0.25);
    for (std::size_t k = 0; k < result.states.size(); ++k) {
      const double speed = simulated.motion.state(0.25 * static_cast<double>(k)).velocity.norm();
      EXPECT_NEAR(result.states[k].velocity.norm(), speed, 0.1);
    }
  }
}

TEST(InertialInitialization, StatesAreThePosesOfTheAlignedMap) {
  Random random(2);
  const auto simulated = simulate(15, 2.5, 0.001, random);
  const auto result = initialize_inertial(simulated.problem, {});
  ASSERT_TRUE(result.solved);
  for (std::size_t k = 0; k < result.states.size(); ++k) {
    const SE3 camera = move_pose(result.aligned_from_world, simulated.problem.world_from_camera[k]);
    const SE3 body = camera * simulated.problem.body_from_camera.inverse();
    EXPECT_LT(se3_minus(body, result.states[k].world_from_body).norm(), 1e-9);
  }
}

TEST(InertialInitialization, KeepsTheScaleOfAMetricMap) {
  Random random(3);
  for (int i = 0; i < 10; ++i) {
    const auto simulated = simulate(10, 1, 0.001, random);
    const auto result = initialize_inertial(simulated.problem, {});
    ASSERT_TRUE(result.accepted) << result.missing;
    EXPECT_DOUBLE_EQ(result.aligned_from_world.scale, 1);
    EXPECT_EQ(result.scale_sigma, 0);
    EXPECT_LT(gravity_error(simulated, result), 0.03);
  }
}

TEST(InertialInitialization, StandardDeviationsAreHonest) {
  Random random(4);
  double normalised = 0;
  const int runs = 100;
  for (int i = 0; i < runs; ++i) {
    auto simulated = simulate(16, 1.7, 0, random);
    const auto result = initialize_inertial(
        simulated.problem, {.gyroscope_bias_sigma = 1, .accelerometer_bias_sigma = 1});
    ASSERT_TRUE(result.solved);
    const double error = std::log(result.aligned_from_world.scale / simulated.scale);
    normalised += error * error / (result.scale_sigma * result.scale_sigma) / runs;
    EXPECT_NEAR(result.chi2_ratio, 1, 0.75);
  }
  EXPECT_NEAR(normalised, 1, 0.4);  // 95% bounds of the mean are 0.28 wide; statistics scale it
}

TEST(InertialInitialization, SaysWhatIsMissing) {
  Random random(5);
  auto few = simulate(5, 2, 0.002, random);
  const auto early = initialize_inertial(few.problem, {});
  EXPECT_FALSE(early.accepted);
  EXPECT_THAT(early.missing, HasSubstr("time"));

  // Straight flight at constant speed: neither rotation nor acceleration.
  Simulated straight = few;
  straight.problem.world_from_camera.clear();
  straight.problem.motions.clear();
  const ImuNoise noise = simulated_noise(10);
  SimulatedMotion still;
  for (int i = 0; i < 20; ++i) {
    straight.problem.world_from_camera.emplace_back(
        straight.problem.body_from_camera.rotation,
        Eigen::Vector3d(0.1 * i, 0, 0) + 0.001 * random_gaussian_vector(random));
    if (i == 19) break;
    straight.problem.motions.emplace_back(
        simulate_imu(still, 0.25 * i, 0.25 * (i + 1), 200, kBias, noise, random), ImuBias{}, noise);
  }
  const auto result = initialize_inertial(straight.problem, {});
  EXPECT_FALSE(result.accepted);
  EXPECT_THAT(result.missing, HasSubstr("rotation and acceleration"));
}

TEST(InertialInitialization, NoticesContradictions) {
  Random random(6);
  auto simulated = simulate(20, 1.5, 0.001, random);
  simulated.problem.body_from_camera.rotation =
      simulated.problem.body_from_camera.rotation * so3_exp({0, 0, 1.5});  // swapped axes
  const auto result = initialize_inertial(simulated.problem, {});
  EXPECT_FALSE(result.accepted);
  EXPECT_FALSE(result.missing.empty());
}

TEST(InertialInitialization, RefusesWhatMakesNoSense) {
  Random random(7);
  auto problem = simulate(5, 2, 0, random).problem;
  EXPECT_THROW(initialize_inertial(problem, {.iterations = 0}), InputError);
  EXPECT_THROW(initialize_inertial(problem, {.max_scale_sigma = 0}), InputError);
  problem.motions.pop_back();
  EXPECT_THROW(initialize_inertial(problem, {}), std::invalid_argument);
  EXPECT_THROW(initialize_inertial({}, {}), std::invalid_argument);
}

// True poses of real flights, scaled and turned, with the real inertial data.
class RealInitialization : public ::testing::TestWithParam<std::string> {};

TEST_P(RealInitialization, FindsTheScaleOfRealFlights) {
  if (!std::filesystem::exists(real_flights_folder() / GetParam()))
    GTEST_SKIP() << real_flights_folder() << " is not here";
  const RealFlight flight = read_real_flight(GetParam());
  const SE3 turned(so3_exp({0.5, 1.5, -0.7}), {1, 2, 3});
  const double scale = 3.3;
  std::size_t accepted = 0, honest = 0, runs = 0;
  double worst = 0;
  for (std::size_t begin = 2000; begin + 2000 < flight.times.size(); begin += 1000, ++runs) {
    InitializationProblem problem;
    for (std::size_t i = 0; i <= 40; ++i) {  // 10 s
      SE3 pose = turned * flight.states[begin + 50 * i].world_from_body;
      pose.translation /= scale;
      problem.world_from_camera.push_back(pose);
      if (i == 40) break;
      problem.motions.emplace_back(
          flight.imu.between(flight.times[begin + 50 * i], flight.times[begin + 50 * (i + 1)]),
          ImuBias{}, ImuNoise::of(euroc_imu(), {}));
    }
    const auto result = initialize_inertial(problem, {});
    if (!result.accepted) continue;
    ++accepted;
    const double error = std::abs(std::log(result.aligned_from_world.scale / scale));
    worst = std::max(worst, error);
    honest += error < 3 * result.scale_sigma;
  }
  std::printf(
      "%-15s %zu of %zu stretches of 10 s accepted, %zu within 3 sigma, worst scale error "
      "%.1f%%\n",
      GetParam().c_str(), accepted, runs, honest, 100 * worst);
  EXPECT_GE(2 * accepted, runs);
  EXPECT_GE(10 * honest, 9 * accepted);
  EXPECT_LT(worst, 0.06);
}

// The clip of V1_01 beside the checkout: 4.45 s of gentle flight hold just about enough.
TEST(InertialInitialization, KnowsHowLittleAGentleClipSays) {
  if (!std::filesystem::exists(real_flights_folder() / "V1_01_easy"))
    GTEST_SKIP() << real_flights_folder() << " is not here";
  const RealFlight flight = read_real_flight("V1_01_easy");
  const auto first = std::lower_bound(flight.times.begin(), flight.times.end(), kClipBegin);
  for (const std::size_t count : {18u, 60u}) {  // 4.5 s and 15 s
    InitializationProblem problem;
    for (std::size_t i = 0; i <= count; ++i) {
      const std::size_t at = static_cast<std::size_t>(first - flight.times.begin()) + 5 * i;
      problem.world_from_camera.push_back(flight.states[at].world_from_body);
      if (i == count) break;
      problem.motions.emplace_back(flight.imu.between(flight.times[at], flight.times[at + 5]),
                                   ImuBias{}, ImuNoise::of(euroc_imu(), {}));
    }
    const auto result = initialize_inertial(problem, {});
    ASSERT_TRUE(result.solved);
    std::printf("V1_01, %.2f s: scale %.3f, said to be known to %.3f; %s\n",
                0.25 * static_cast<double>(count), result.aligned_from_world.scale,
                result.scale_sigma, result.missing.c_str());
    EXPECT_NEAR(result.aligned_from_world.scale, 1, 2 * result.scale_sigma);
    EXPECT_LT(result.scale_sigma, count == 18 ? 0.08 : 0.03);
  }
}

INSTANTIATE_TEST_SUITE_P(Euroc, RealInitialization, ::testing::ValuesIn(real_flight_names()));

}  // namespace
}  // namespace rover
