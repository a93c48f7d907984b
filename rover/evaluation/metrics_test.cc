#include "rover/evaluation/metrics.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/base/random.h"

namespace rover {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::SizeIs;

SE3 at(double x, double y, double z, double yaw = 0) {
  return {so3_exp({0, 0, yaw}), Eigen::Vector3d(x, y, z)};
}

// A winding path in all three directions, 10 Hz.
Trajectory winding_path(int count) {
  Trajectory trajectory;
  for (int i = 0; i < count; ++i) {
    const double t = 0.1 * i;
    trajectory.push_back(
        {from_seconds(t), at(3 * std::cos(t), 2 * std::sin(1.3 * t), std::sin(0.7 * t), 0.5 * t)});
  }
  return trajectory;
}

TEST(Statistics, AreThoseOfThePopulation) {
  const auto s = statistics_of({4, 1, 2, 3});
  EXPECT_EQ(s.count, 4u);
  EXPECT_DOUBLE_EQ(s.mean, 2.5);
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(7.5));
  EXPECT_DOUBLE_EQ(s.std, std::sqrt(1.25));
  EXPECT_DOUBLE_EQ(s.min, 1);
  EXPECT_DOUBLE_EQ(s.max, 4);
  EXPECT_DOUBLE_EQ(statistics_of({5, 1, 2}).median, 2);
  EXPECT_EQ(statistics_of({}).count, 0u);
}

TEST(Associate, TakesTheNearestWithinTheLimit) {
  const Trajectory reference = {
      {1000, at(1, 0, 0)}, {2000, at(2, 0, 0)}, {3000, at(3, 0, 0)}, {4000, at(4, 0, 0)}};
  const Trajectory estimate = {{900, at(10, 0, 0)}, {2600, at(20, 0, 0)}, {9000, at(30, 0, 0)}};
  const auto pairs = associate(estimate, reference, 500e-9);
  ASSERT_THAT(pairs, SizeIs(2));
  EXPECT_EQ(pairs[0].time, 900);
  EXPECT_EQ(pairs[0].reference.translation.x(), 1);
  EXPECT_EQ(pairs[1].estimate.translation.x(), 20);
  EXPECT_EQ(pairs[1].reference.translation.x(), 3);
  EXPECT_THAT(associate(estimate, {}, 1), SizeIs(0));
}

TEST(Associate, GoesThroughTheShorterTrajectory) {
  const Trajectory reference = {{1000, at(1, 0, 0)}, {2000, at(2, 0, 0)}};
  const Trajectory estimate = {{900, at(10, 0, 0)}, {1010, at(20, 0, 0)}, {2100, at(30, 0, 0)}};
  const auto pairs = associate(estimate, reference, 1);
  ASSERT_THAT(pairs, SizeIs(2));
  EXPECT_EQ(pairs[0].time, 1010);
  EXPECT_EQ(pairs[0].reference.translation.x(), 1);
  EXPECT_EQ(pairs[1].estimate.translation.x(), 30);
}

TEST(AbsoluteError, VanishesUnderTheRightAlignment) {
  const Trajectory reference = winding_path(80);
  const Sim3 similarity(0.5, so3_exp({0.1, -0.4, 2}), {3, -1, 2});
  const Sim3 rigid(1, so3_exp({0.1, -0.4, 2}), {3, -1, 2});
  const Sim3 turn(1, so3_exp({0, 0, 2}), {3, -1, 2});
  for (const auto& [kind, transform] : {std::pair{AlignmentKind::kSimilarity, similarity},
                                        {AlignmentKind::kRigid, rigid},
                                        {AlignmentKind::kUpright, turn}}) {
    Trajectory estimate = reference;
    for (auto& stamped : estimate) stamped.pose = move_pose(transform, stamped.pose);
    const auto pairs = associate(estimate, reference, 0.02);
    const auto alignment = align(pairs, kind);
    ASSERT_TRUE(alignment);
    EXPECT_NEAR(alignment->scale, 1 / transform.scale, 1e-9);
    const auto aligned = move_estimates(*alignment, pairs);
    EXPECT_LT(statistics_of(position_errors(aligned)).max, 1e-9);
    const auto relative = frame_to_frame_errors(aligned);
    EXPECT_LT(statistics_of(relative.translation).max, 1e-9);
    EXPECT_LT(statistics_of(relative.rotation).max, 1e-5);
    EXPECT_LT(distance_errors(aligned).translation, 1e-6);
  }
}

TEST(AbsoluteError, IsTheLengthOfTheOffsets) {
  const std::vector<PosePair> pairs = {{0, at(1, 0, 0), at(0, 0, 0)},
                                       {1, at(0, 3, 4), at(0, 0, 0)}};
  EXPECT_THAT(position_errors(pairs), ElementsAre(1, 5));
}

TEST(Align, RefusesWhatIsNotDetermined) {
  const std::vector<PosePair> two = {{0, at(0, 0, 0), at(0, 0, 0)}, {1, at(1, 0, 0), at(1, 0, 0)}};
  EXPECT_FALSE(align(two, AlignmentKind::kRigid));
  EXPECT_FALSE(align(two, AlignmentKind::kSimilarity));
  EXPECT_FALSE(align({}, AlignmentKind::kUpright));
}

TEST(RelativeError, SeesMotionNotPlace) {
  // The second step is 0.1 m too long and turned by 2 degrees.
  const double wrong = 2 * std::numbers::pi / 180;
  const std::vector<PosePair> pairs = {{0, at(5, 0, 0), at(0, 0, 0)},
                                       {1, at(6, 0, 0), at(1, 0, 0)},
                                       {2, at(7.1, 0, 0, wrong), at(2, 0, 0)}};
  const auto errors = frame_to_frame_errors(pairs);
  EXPECT_THAT(errors.translation, ElementsAre(DoubleNear(0, 1e-12), DoubleNear(0.1, 1e-12)));
  EXPECT_THAT(errors.rotation, ElementsAre(DoubleNear(0, 1e-9), DoubleNear(2, 1e-9)));
  EXPECT_THAT(frame_to_frame_errors({}).translation, SizeIs(0));
}

TEST(DistanceErrors, AreThePercentagesOfAWrongScale) {
  std::vector<PosePair> pairs;
  for (int i = 0; i <= 1000; ++i) pairs.push_back({i, at(1.02 * i, 0, 0), at(i, 0, 0)});
  const auto errors = distance_errors(pairs);
  EXPECT_THAT(errors.lengths, ElementsAre(100, 200, 300, 400, 500, 600, 700, 800));
  EXPECT_NEAR(errors.translation, 2, 1e-9);
  EXPECT_NEAR(errors.rotation, 0, 1e-9);
  EXPECT_EQ(errors.count, 91u + 81 + 71 + 61 + 51 + 41 + 31 + 21);
}

TEST(DistanceErrors, AreTheDriftOfATurn) {
  std::vector<PosePair> pairs;
  for (int i = 0; i <= 50; ++i) {
    pairs.push_back({i, at(0.1 * i, 0, 0, 0.001 * i), at(0.1 * i, 0, 0)});
  }
  const auto errors = distance_errors(pairs);  // 0.01 rad per metre, over 0.5 m to 4 m
  ASSERT_THAT(errors.lengths, SizeIs(8));
  EXPECT_NEAR(errors.lengths[0], 0.5, 1e-9);
  EXPECT_NEAR(errors.rotation, 0.01 * 180 / std::numbers::pi, 0.05);
  EXPECT_GT(errors.translation, 0.1);
  EXPECT_EQ(distance_errors({}).count, 0u);
  const std::vector<PosePair> still = {{0, at(0, 0, 0), at(0, 0, 0)},
                                       {1, at(1, 0, 0), at(0, 0, 0)}};
  EXPECT_EQ(distance_errors(still).count, 0u);
}

TEST(PathLength, FollowsTheReference) {
  const std::vector<PosePair> pairs = {
      {0, SE3(), at(0, 0, 0)}, {1, SE3(), at(3, 4, 0)}, {2, SE3(), at(3, 4, 2)}};
  EXPECT_DOUBLE_EQ(path_length(pairs), 7);
  EXPECT_EQ(path_length({}), 0);
}

TEST(LongestGap, CountsBothEnds) {
  const Timestamp s = kNanosecondsPerSecond;
  const Trajectory trajectory = {{2 * s, SE3()}, {3 * s, SE3()}, {6 * s, SE3()}};
  EXPECT_DOUBLE_EQ(longest_gap(trajectory, 2 * s, 6 * s), 3);
  EXPECT_DOUBLE_EQ(longest_gap(trajectory, -3 * s, 6 * s), 5);
  EXPECT_DOUBLE_EQ(longest_gap(trajectory, 2 * s, 10 * s), 4);
  EXPECT_DOUBLE_EQ(longest_gap({}, 0, 10 * s), 10);
}

}  // namespace
}  // namespace rover
