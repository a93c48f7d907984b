#include "rover/imu/clock_shift.h"

#include <gtest/gtest.h>

#include "rover/imu/simulated_motion.h"

namespace rover {
namespace {

constexpr double kInterval = 0.25;
const ImuBias kBias = {{0.01, -0.02, 0.03}, {0.1, 0.2, -0.1}};

// Motions between keyframes, of a sensor whose stamps are `late` seconds too late.
std::vector<Preintegration> flown(const SimulatedMotion& motion, int count, double late) {
  std::vector<Preintegration> motions;
  for (int i = 0; i < count; ++i) {
    std::vector<ImuSample> samples;
    for (int k = 0; k <= 50; ++k) {
      const double time = kInterval * i + 0.005 * k;
      samples.push_back(motion.sample(time - late, kBias));
      samples.back().time = from_seconds(time);
    }
    motions.emplace_back(std::move(samples), kBias, simulated_noise());
  }
  return motions;
}

std::vector<ImuSample> flown_after(const SimulatedMotion& motion, int count, double late) {
  std::vector<ImuSample> samples;
  for (int k = 0; k <= 10; ++k) {
    const double time = kInterval * count + 0.005 * k;
    samples.push_back(motion.sample(time - late, kBias));
    samples.back().time = from_seconds(time);
  }
  return samples;
}

void expect_near(const InertialDelta& a, const InertialDelta& b, double tolerance) {
  EXPECT_LT((a.position - b.position).norm(), tolerance);
  EXPECT_LT((a.velocity - b.velocity).norm(), tolerance);
  EXPECT_LT(so3_log(a.rotation.conjugate() * b.rotation).norm(), tolerance);
}

TEST(ClockShift, GivesTheMotionsOfTheRightMoments) {
  Random random(1);
  const auto motion = SimulatedMotion::random(random);
  const auto truth = flown(motion, 4, 0);
  for (const double late : {0.02, 0.013, -0.0171}) {
    const auto shifted = with_shifted_clock(flown(motion, 4, late), flown_after(motion, 4, late),
                                            from_seconds(late));
    ASSERT_EQ(shifted.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(shifted[i].begin(), truth[i].begin());
      EXPECT_EQ(shifted[i].end(), truth[i].end());
      const bool is_held = i == 0 && late < 0;  // there is nothing before the first motion
      expect_near(shifted[i].delta(), truth[i].delta(), is_held ? 5e-3 : 1e-4);
    }
  }
}

TEST(ClockShift, HoldsTheLastReadingWhereNothingFollows) {
  Random random(2);
  const auto motion = SimulatedMotion::random(random);
  const auto shifted = with_shifted_clock(flown(motion, 2, 0.04), {}, from_seconds(0.04));
  EXPECT_EQ(shifted.back().end(), from_seconds(2 * kInterval));
  EXPECT_NEAR(shifted.back().longest_step(), 0.04, 1e-6);
}

TEST(ClockShift, OfNothingIsNothing) {
  Random random(3);
  const auto motions = flown(SimulatedMotion::random(random), 2, 0);
  EXPECT_TRUE(with_shifted_clock({}, {}, 1000).empty());
  const auto same = with_shifted_clock(motions, {}, 0);
  for (std::size_t i = 0; i < 2; ++i) expect_near(same[i].delta(), motions[i].delta(), 1e-12);
}

}  // namespace
}  // namespace rover
