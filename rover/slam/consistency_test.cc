// Errors beside what the covariances say, over simulated flights. ROVER_FLIGHTS: how many (default
// 3, of which the bounds are wider); docs/inertial.md has the figures of 30.
#include <cstdlib>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "rover/optimization/drift.h"
#include "rover/slam/simulated_run.h"

namespace rover {
namespace {

int flights() {
  const char* wanted = std::getenv("ROVER_FLIGHTS");
  return wanted ? std::atoi(wanted) : 3;
}

// Mean normalised squared error over flights, with the 95% bounds of such a mean (normal
// approximation of the chi-square distribution).
struct Nees {
  const char* name;
  int freedom;
  double sum = 0;
  int count = 0;

  void add(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
    sum += error.dot(covariance.ldlt().solve(error));
    ++count;
  }
  double mean() const { return sum / count; }
  double half_width(int independent) const { return 1.96 * std::sqrt(2.0 * freedom / independent); }

  // The frames of one flight tell the same error again and again: flights alone are independent.
  void expect_within_bounds(int independent) const {
    EXPECT_NEAR(mean(), freedom, half_width(independent)) << name;
  }
  void print(int independent) const {
    std::printf("%s %.2f of %d (+-%.2f)\n", name, mean(), freedom, half_width(independent));
  }
};

// The true state moved by the position and yaw that make one pose equal another.
InertialState moved_onto(const InertialState& truth, const SE3& from, const SE3& to) {
  const Eigen::Quaterniond turned = to.rotation * from.rotation.conjugate();
  const double yaw = std::atan2(2 * (turned.w() * turned.z() + turned.x() * turned.y()),
                                1 - 2 * (turned.y() * turned.y() + turned.z() * turned.z()));
  const Eigen::Quaterniond rotation = so3_exp({0, 0, yaw});
  InertialState moved = truth;
  moved.world_from_body.rotation = rotation * truth.world_from_body.rotation;
  moved.world_from_body.translation =
      to.translation + rotation * (truth.world_from_body.translation - from.translation);
  moved.velocity = rotation * truth.velocity;
  return moved;
}

Eigen::Vector4d drift_between(const InertialState& truth, const InertialState& estimate) {
  const SE3& pose = estimate.world_from_body;
  const Vector6d error = se3_minus(truth.world_from_body, pose);
  const Eigen::Vector3d turn = pose.rotation * error.tail<3>();
  Eigen::Vector4d drift;
  drift << pose.rotation * error.head<3>() -
               turn.z() * Eigen::Vector3d::UnitZ().cross(pose.translation),
      turn.z();
  return drift;
}

struct Figures {
  Nees motion{"velocity and biases", 9}, velocity{"velocity", 3}, gyroscope{"gyroscope bias", 3},
      accelerometer{"accelerometer bias", 3}, world{"position and yaw", 4};
  double position_error = 0, position_sigma = 0;

  void add_motion(const Vector9d& error, const Matrix9d& covariance) {
    motion.add(error, covariance);
    Nees* const parts[] = {&velocity, &gyroscope, &accelerometer};
    for (int i = 0; i < 3; ++i)
      parts[i]->add(error.segment<3>(3 * i), covariance.block<3, 3>(3 * i, 3 * i));
  }
};

// What the last of a flight's frames say.
void judge(const SimulatedRunOptions& options, Figures& figures) {
  SimulatedRun run(options);
  run.fly([&](const TrackingResult& result, const InertialState& truth) {
    if (!result.inertial || seconds_between(0, result.anchored.time) < 8) return;
    const Keyframe& first = *run.map()->view()->keyframes().begin();
    const InertialState& estimate = *result.inertial;
    const SE3 begin = run.truth(seconds_between(0, first.frame.time)).world_from_body;
    const InertialState world = moved_onto(truth, begin, first.world_from_body());
    const Matrix6d covariance = with_drift(
        estimate.world_from_body, result.inertial_covariance.topLeftCorner<6, 6>(), result.drift);
    const Eigen::Vector4d drift = drift_between(world, estimate);
    figures.world.add(drift, drift_of(estimate.world_from_body, covariance));
    const InertialState here = moved_onto(truth, truth.world_from_body, estimate.world_from_body);
    figures.add_motion(state_minus(here, estimate).tail<9>(),
                       result.inertial_covariance.bottomRightCorner<9, 9>());
    figures.position_error +=
        (world.world_from_body.translation - estimate.world_from_body.translation).squaredNorm();
    figures.position_sigma += covariance.topLeftCorner<3, 3>().trace();
  });
}

class SimulatedRuns : public ::testing::TestWithParam<int> {};

TEST_P(SimulatedRuns, StrayAboutAsFarAsStated) {
  Figures figures;
  for (int i = 0; i < flights(); ++i) {
    judge({.cameras = GetParam(), .seed = static_cast<std::uint64_t>(i + 1)}, figures);
  }
  ASSERT_GT(figures.world.count, 50 * flights());
  for (const Nees* nees : {&figures.motion, &figures.velocity, &figures.gyroscope,
                           &figures.accelerometer, &figures.world}) {
    nees->print(flights());
    if (GetParam() > 1) nees->expect_within_bounds(flights());  // mono is not quite: inertial.md
  }
  std::printf("position rms %.1f mm, stated %.1f mm\n",
              1e3 * std::sqrt(figures.position_error / figures.world.count),
              1e3 * std::sqrt(figures.position_sigma / figures.world.count));
  const double ratio = std::sqrt(figures.position_error / figures.position_sigma);
  EXPECT_GT(ratio, 0.5);
  EXPECT_LT(ratio, 2);
}

INSTANTIATE_TEST_SUITE_P(Rigs, SimulatedRuns, ::testing::Values(1, 2));

std::vector<InertialState> states_of(const SimulatedRunOptions& options) {
  std::vector<InertialState> states;
  SimulatedRun run(options);
  run.fly([&](const TrackingResult& result, const InertialState&) {
    if (result.inertial) states.push_back(*result.inertial);
  });
  return states;
}

TEST(SimulatedRun, IsTheSameTwice) {
  const auto a = states_of({.duration = 10, .seed = 2}), b = states_of({.duration = 10, .seed = 2});
  ASSERT_GT(a.size(), 20u);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].world_from_body.translation, b[i].world_from_body.translation);
    EXPECT_EQ(a[i].world_from_body.rotation.coeffs(), b[i].world_from_body.rotation.coeffs());
    EXPECT_EQ(a[i].velocity, b[i].velocity);
    EXPECT_EQ(a[i].bias.vector(), b[i].bias.vector());
  }
}

// Pixels differ by rounding alone.
TEST(SimulatedRun, DoesNotMindWhereTheWorldIs) {
  const auto a = states_of({.duration = 10, .seed = 2});
  const auto b = states_of({.duration = 10, .yaw = 1.1, .shift = {3, -7, 2}, .seed = 2});
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_LT(state_minus(a[i], b[i]).norm(), 1e-3) << i;
}

// Along a wall nothing is seen again.
TEST_P(SimulatedRuns, NeverStateLessDriftWithoutARevisit) {
  SimulatedRun run({.cameras = GetParam(), .seed = 2});
  Eigen::Matrix4d before = Eigen::Matrix4d::Zero();
  int epoch = -1, compared = 0;
  run.fly([&](const TrackingResult& result, const InertialState&) {
    if (!result.inertial) return;
    if (result.epoch == epoch) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> growth(result.drift - before);
      EXPECT_GT(growth.eigenvalues()[0], -1e-10) << seconds_between(0, result.anchored.time);
      ++compared;
    }
    epoch = result.epoch;
    before = result.drift;
  });
  EXPECT_GT(compared, GetParam() > 1 ? 80 : 50);  // mono announces scales until one is certain
  EXPECT_GT(before.trace(), 1e-6);
}

}  // namespace
}  // namespace rover
