#include "rover/imu/imu_buffer.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace rover {
namespace {

constexpr Timestamp kStep = 5'000'000;

// Readings that grow by one per step.
ImuSample sample(int index) {
  return {index * kStep, Eigen::Vector3d::Constant(index), Eigen::Vector3d::Constant(-index)};
}

ImuBuffer filled(int count) {
  ImuBuffer buffer;
  for (int i = 0; i < count; ++i) buffer.add(sample(i));
  return buffer;
}

TEST(ImuBuffer, InterpolatesBothEnds) {
  const auto samples = filled(11).between(kStep * 5 / 2, kStep * 25 / 4);
  ASSERT_EQ(samples.size(), 6u);
  EXPECT_EQ(samples.front().time, kStep * 5 / 2);
  EXPECT_EQ(samples.back().time, kStep * 25 / 4);
  EXPECT_DOUBLE_EQ(samples.front().angular_velocity.x(), 2.5);
  EXPECT_DOUBLE_EQ(samples.back().acceleration.y(), -6.25);
  for (int i = 1; i < 5; ++i) EXPECT_EQ(samples[i].time, (i + 2) * kStep);
}

TEST(ImuBuffer, ShiftsItsStamps) {
  ImuBuffer buffer = filled(11);
  buffer.shift(-2 * kStep);
  const auto samples = buffer.between(0, 2 * kStep);
  ASSERT_EQ(samples.size(), 3u);
  EXPECT_DOUBLE_EQ(samples.front().angular_velocity.x(), 2);
  EXPECT_DOUBLE_EQ(samples.back().angular_velocity.x(), 4);
}

TEST(ImuBuffer, DoesNotDoubleSamplesAtTheEnds) {
  const auto samples = filled(11).between(2 * kStep, 4 * kStep);
  ASSERT_EQ(samples.size(), 3u);
  EXPECT_EQ(samples[0].time, 2 * kStep);
  EXPECT_EQ(samples[1].time, 3 * kStep);
  EXPECT_EQ(samples[2].time, 4 * kStep);
  EXPECT_DOUBLE_EQ(samples[2].angular_velocity.x(), 4);
}

TEST(ImuBuffer, ConsecutiveIntervalsJoin) {
  const ImuBuffer buffer = filled(11);
  const auto a = buffer.between(kStep / 2, 3 * kStep + 7);
  const auto b = buffer.between(3 * kStep + 7, 9 * kStep);
  EXPECT_EQ(a.back().time, b.front().time);
  EXPECT_EQ(a.back().angular_velocity, b.front().angular_velocity);
}

TEST(ImuBuffer, LastSampleStandsForAShortWhile) {
  const ImuBuffer buffer = filled(11);
  const auto samples = buffer.between(8 * kStep, 12 * kStep);
  ASSERT_EQ(samples.size(), 4u);
  EXPECT_EQ(samples.back().time, 12 * kStep);
  EXPECT_DOUBLE_EQ(samples.back().angular_velocity.x(), 10);
  EXPECT_TRUE(buffer.between(8 * kStep, 16 * kStep).empty());
  EXPECT_TRUE(buffer.between(-9 * kStep, 4 * kStep).empty());
  EXPECT_TRUE(buffer.between(11 * kStep, 12 * kStep).empty());
  EXPECT_TRUE(buffer.between(4 * kStep, 4 * kStep).empty());
  EXPECT_TRUE(ImuBuffer().between(0, kStep).empty());
}

TEST(ImuBuffer, RefusesBrokenSamples) {
  ImuBuffer buffer = filled(3);
  EXPECT_FALSE(buffer.add(sample(2)));
  EXPECT_FALSE(buffer.add(sample(1)));
  ImuSample broken = sample(5);
  broken.acceleration.x() = std::nan("");
  EXPECT_FALSE(buffer.add(broken));
  broken.acceleration.x() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(buffer.add(broken));
  EXPECT_EQ(buffer.refused(), 4);
  EXPECT_EQ(buffer.samples().size(), 3u);
}

TEST(ImuBuffer, ForgetsOnlyWhatIsNotNeeded) {
  ImuBuffer buffer = filled(11);
  const Timestamp from = kStep * 9 / 2;
  const auto before = buffer.between(from, 9 * kStep);
  buffer.forget_before(from);
  EXPECT_EQ(buffer.samples().front().time, 4 * kStep);
  const auto after = buffer.between(from, 9 * kStep);
  ASSERT_EQ(after.size(), before.size());
  EXPECT_EQ(after.front().angular_velocity, before.front().angular_velocity);
}

}  // namespace
}  // namespace rover
