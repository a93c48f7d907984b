#include "rover/optimization/map_error.h"

#include <gtest/gtest.h>

#include "rover/geometry/sim3.h"
#include "rover/imu/simulated_motion.h"

namespace rover {
namespace {

const Eigen::Vector3d kLever(0.05, 0.06, 0.02);

InertialState random_state(Random& random) {
  return {{so3_exp(random_gaussian_vector(random)), 3 * random_gaussian_vector(random)},
          random_gaussian_vector(random),
          {0.1 * random_gaussian_vector(random), random_gaussian_vector(random)}};
}

// The state in a map that is turned and grows about a place.
InertialState moved(const InertialState& state, const Eigen::Vector3d& error,
                    const Eigen::Vector3d& pivot) {
  const Eigen::Quaterniond turn = so3_exp({error[0], error[1], 0});
  const double scale = std::exp(error[2]);
  const Sim3 map(scale, turn, pivot - scale * (turn * pivot));
  const SE3 body_from_camera(Eigen::Quaterniond::Identity(), kLever);
  const SE3 camera = move_pose(map, state.world_from_body * body_from_camera);
  return {camera * body_from_camera.inverse(), scale * (turn * state.velocity), state.bias};
}

TEST(MapError, MovesAStateWithTheMap) {
  Random random(1);
  constexpr double kStep = 1e-4;
  for (int i = 0; i < 20; ++i) {
    const InertialState state = random_state(random);
    const Eigen::Vector3d pivot = 2 * random_gaussian_vector(random);
    const Matrix15x3d by_error = by_map_error(state, kLever, pivot);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(k);
      const Vector15d more = state_minus(moved(state, step, pivot), state);
      const Vector15d less = state_minus(moved(state, -step, pivot), state);
      const Vector15d numeric = (more - less) / (2 * kStep);
      EXPECT_LT((numeric - by_error.col(k)).norm(), 1e-6) << k;
    }
  }
}

// To turn both states is to turn gravity the other way.
TEST(MapError, InertialDataNoticeTheTilt) {
  Random random(2);
  const SimulatedMotion motion = SimulatedMotion::random(random);
  const Preintegration between(simulate_imu(motion, 0, 0.3, 200, {}, simulated_noise(), random), {},
                               simulated_noise());
  const InertialState from = motion.state(0), to = motion.state(0.3);
  ImuJacobians by;
  imu_residual(between, from, to, gravity_of_z_up(), &by);
  const Matrix15x3d noticed =
      by.by_from * by_map_error(from, kLever) + by.by_to * by_map_error(to, kLever);
  const Matrix15x3d by_gravity = by.by_gravity * skew(gravity_of_z_up());
  EXPECT_GT(by_gravity.leftCols<2>().norm(), 1);
  EXPECT_LT((noticed - by_gravity).leftCols<2>().norm(), 1e-6 * by_gravity.norm());
}

}  // namespace
}  // namespace rover
