#include "rover/imu/rest.h"

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/imu/simulated_motion.h"

namespace rover {
namespace {

const ImuBias kBias = {{0.02, -0.01, 0.03}, {0.1, 0.2, -0.1}};

SimulatedMotion motionless() { return {}; }

std::vector<ImuSample> readings(const SimulatedMotion& motion, double noise = 1) {
  Random random(5);
  return simulate_imu(motion, 0, 0.5, 200, kBias, simulated_noise(noise), random);
}

bool quiet(const std::vector<ImuSample>& samples) { return is_quiet(samples, kBias, {}); }

TEST(Rest, IsSeenThroughBiasAndNoise) {
  EXPECT_TRUE(quiet(readings(motionless())));
  EXPECT_FALSE(quiet({}));
}

TEST(Rest, IsNotVibration) { EXPECT_FALSE(quiet(readings(motionless(), 15))); }

TEST(Rest, IsNotASlowTurn) {
  SimulatedMotion motion;
  motion.angles[2] = {0.05, 1, 0};
  EXPECT_FALSE(quiet(readings(motion)));
}

TEST(Rest, IsNotAPush) {
  SimulatedMotion motion;
  motion.position[2] = {0.4, 1, 1.5};
  EXPECT_FALSE(quiet(readings(motion)));
}

TEST(Rest, RefusesLimitsThatMakeNoSense) {
  RestOptions options;
  options.gravity = 0;
  EXPECT_THROW(options.check(), InputError);
}

}  // namespace
}  // namespace rover
