#include "rover/simulation/spline_motion.h"

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/simulation/test_motion.h"

namespace rover {
namespace {

TEST(SplineBasis, WeightsSumToOne) {
  for (double u = 0; u <= 1; u += 0.125) {
    const SplineBasis basis = SplineBasis::at(u, 0.2);
    EXPECT_NEAR(basis.value.sum(), 1, 1e-15);
    EXPECT_GE(basis.value.minCoeff(), -1e-15);
    EXPECT_NEAR(basis.first.sum(), 0, 1e-14);
    EXPECT_NEAR(basis.second.sum(), 0, 1e-12);
    EXPECT_NEAR(basis.cumulative().value[0], 1, 1e-15);
    EXPECT_EQ(basis.cumulative().value[5], basis.value[5]);
  }
}

TEST(SplineBasis, ReproducesStraightMotion) {
  // Control point i sits at (i - 2) intervals.
  for (double u = 0; u <= 1; u += 0.1) {
    const SplineBasis basis = SplineBasis::at(u, 0.5);
    const SplineBasis::Weights line = SplineBasis::Weights::LinSpaced(-2, 3);
    EXPECT_NEAR(basis.value.dot(line), u, 1e-15);
    EXPECT_NEAR(basis.first.dot(line), 2, 1e-14);
  }
}

TEST(SplineMotion, DerivativesAreThoseOfThePose) {
  constexpr double kStep = 1e-5;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const SplineMotion motion = random_motion(-1, 0.1, 26, seed);
    EXPECT_NEAR(motion.end(), 1.1, 1e-12);
    for (double t = -0.99; t < 1.09; t += 0.0713) {
      const MotionState state = motion.at(t);
      const MotionState before = motion.at(t - kStep), after = motion.at(t + kStep);
      const Vector6d moved = se3_minus(after.world_from_body, before.world_from_body);
      const auto slope = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
        return Eigen::Vector3d((to - from) / (2 * kStep));
      };
      EXPECT_LT((moved.tail<3>() / (2 * kStep) - state.angular_velocity).norm(), 1e-6);
      EXPECT_LT((slope(before.world_from_body.translation, after.world_from_body.translation) -
                 state.velocity)
                    .norm(),
                1e-7);
      EXPECT_LT((slope(before.velocity, after.velocity) - state.acceleration).norm(), 1e-6);
      EXPECT_LT(
          (slope(before.angular_velocity, after.angular_velocity) - state.angular_acceleration)
              .norm(),
          1e-6);
    }
  }
}

TEST(SplineMotion, AccelerationsHaveNoJumpsAtKnots) {
  const SplineMotion motion = random_motion(0, 0.1, 30, 7);
  for (int knot = 1; knot < 24; ++knot) {
    const MotionState before = motion.at(0.1 * knot - 1e-9), after = motion.at(0.1 * knot + 1e-9);
    EXPECT_LT((before.acceleration - after.acceleration).norm(), 1e-6);
    EXPECT_LT((before.angular_acceleration - after.angular_acceleration).norm(), 1e-6);
  }
}

TEST(SplineMotion, PoseAloneIsTheSame) {
  const SplineMotion motion = random_motion(0, 0.1, 30, 8);
  for (double t = 0; t <= motion.end(); t += 0.037) {
    EXPECT_LT(se3_minus(motion.pose_at(t), motion.at(t).world_from_body).norm(), 1e-14);
  }
}

TEST(SplineMotion, EndsWhereItIsCutOff) {
  const SplineMotion motion = random_motion(3, 0.25, 9, 9);
  EXPECT_EQ(motion.begin(), 3);
  EXPECT_NEAR(motion.end(), 4, 1e-12);
  EXPECT_EQ(motion.place_of(3).first, 0);
  EXPECT_EQ(motion.place_of(4).first, 3);
  EXPECT_NEAR(motion.place_of(4).u, 1, 1e-12);
  EXPECT_EQ(motion.place_of(99).first, 3);
  EXPECT_EQ(motion.place_of(-99).u, 0);
}

TEST(SplineMotion, RefusesTooFewControlPoints) {
  EXPECT_THROW(SplineMotion(0, 0.1, std::vector<SE3>(5)), InputError);
  EXPECT_THROW(SplineMotion(0, 0, std::vector<SE3>(6)), InputError);
  EXPECT_THROW(SplineMotion(0, std::nan(""), std::vector<SE3>(6)), InputError);
}

}  // namespace
}  // namespace rover
