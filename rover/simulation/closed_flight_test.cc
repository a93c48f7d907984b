#include "rover/simulation/closed_flight.h"

#include <gtest/gtest.h>

#include "rover/base/error.h"

namespace rover {
namespace {

FlightVolume box() { return {{-3, -2, 0.5}, {3, 2, 2.5}, {}, false, 0}; }

FlightOptions lap_of(double seconds, std::uint64_t seed) {
  FlightOptions options;
  options.duration = seconds;
  options.seed = seed;
  // The body of EuRoC's rig: x up, z forwards.
  options.body_from_camera.rotation = so3_exp({0, 0, 1.57});
  return options;
}

TEST(ClosedFlight, RepeatsItselfLapByLap) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const SplineMotion flight = make_closed_flight(box(), lap_of(20, seed), 3);
    ASSERT_NEAR(flight.end(), 60, 1e-6);
    for (const double time : {0.0, 3.3, 12.0, 17.5, 19.99}) {
      const MotionState first = flight.at(time), last = flight.at(time + 40);
      EXPECT_TRUE(first.world_from_body.translation.isApprox(last.world_from_body.translation));
      EXPECT_LT(first.world_from_body.rotation.angularDistance(last.world_from_body.rotation),
                1e-6);
      EXPECT_LT((first.acceleration - last.acceleration).norm(), 1e-6);
      EXPECT_LT((first.angular_velocity - last.angular_velocity).norm(), 1e-6);
    }
  }
}

TEST(ClosedFlight, IsAsSmoothAsOthersAndStaysInside) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const SplineMotion flight = make_closed_flight(box(), lap_of(40, seed), 2);
    for (double time = 0; time <= flight.end(); time += 0.05) {
      const MotionState state = flight.at(time);
      const Eigen::Vector3d position = state.world_from_body.translation;
      EXPECT_TRUE((position.array() >= box().min.array()).all() &&
                  (position.array() <= box().max.array()).all());
      EXPECT_LT(state.velocity.norm(), 2.5) << "seed " << seed << ", " << time << " s";
      EXPECT_LT(state.angular_velocity.norm(), 2.0) << "seed " << seed << ", " << time << " s";
      // The camera never rolls over.
      const Eigen::Vector3d down = state.world_from_body.rotation *
                                   lap_of(40, seed).body_from_camera.rotation *
                                   Eigen::Vector3d::UnitY();
      EXPECT_LT(down.z(), -0.7) << "seed " << seed << ", " << time << " s";
    }
  }
}

TEST(ClosedFlight, RefusesWhatCannotBeClosed) {
  EXPECT_THROW(make_closed_flight(box(), lap_of(20, 1), 0), InputError);
  EXPECT_THROW(make_closed_flight(box(), lap_of(5, 1), 2), InputError);
  FlightVolume corridor = box();
  corridor.path = {{-2, 0, 1}, {2, 0, 1}};
  corridor.path_radius = 0.5;
  EXPECT_THROW(make_closed_flight(corridor, lap_of(20, 1), 2), InputError);
}

}  // namespace
}  // namespace rover
