#include "rover/tracking/stillness.h"

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/imu/simulated_motion.h"
#include "rover/map/test_map.h"

namespace rover {
namespace {

constexpr int kPoints = 40;

// A camera that looks at known points, 20 times a second.
class StillnessTest : public ::testing::Test {
 protected:
  Frame look(const SE3& pose, int visible = kPoints) {
    Frame frame = test_frame(rig_, test_points(kPoints, 1), pose, next_++);
    for (int i = 0; i < visible; ++i) {
      frame[i].landmark = {i};
      frame[i].pixel += 0.3F * Eigen::Vector2f(static_cast<float>(random_.gaussian()),
                                               static_cast<float>(random_.gaussian()));
    }
    return frame;
  }
  std::vector<ImuSample> readings(double inflation = 1) {
    return simulate_imu(SimulatedMotion(), 0, 0.05, 200, {}, simulated_noise(inflation), random_);
  }
  // Looks so many times from a place that moves by `speed` m/s.
  void watch(int frames, double speed = 0, double inflation = 1, int visible = kPoints) {
    for (int i = 0; i < frames; ++i, place_ += speed / 20) {
      detector_.see(look(SE3(Eigen::Quaterniond::Identity(), {place_, 0, 0}), visible),
                    readings(inflation), {});
    }
  }

  Rig rig_ = test_rig();
  Random random_{4};
  std::int64_t next_ = 0;
  double place_ = 0;
  StillnessDetector detector_{{}, 640};
};

TEST_F(StillnessTest, TakesASecond) {
  watch(20);
  EXPECT_FALSE(detector_.still());
  watch(2);
  EXPECT_TRUE(detector_.still());
  watch(600);
  EXPECT_TRUE(detector_.still());
}

TEST_F(StillnessTest, IsNotSteadyFlight) {
  watch(60, 0.05);
  EXPECT_FALSE(detector_.still());
}

TEST_F(StillnessTest, IsNotHoveringInVibration) {
  watch(60, 0, 15);
  EXPECT_FALSE(detector_.still());
}

TEST_F(StillnessTest, NeedsLandmarks) {
  watch(60, 0, 1, 10);
  EXPECT_FALSE(detector_.still());
}

TEST_F(StillnessTest, EndsAtOnce) {
  watch(30);
  ASSERT_TRUE(detector_.still());
  EXPECT_TRUE(detector_.still_after(readings(), {}));
  EXPECT_FALSE(detector_.still_after(readings(15), {}));
  watch(2, 0.5);
  EXPECT_FALSE(detector_.still());
}

TEST_F(StillnessTest, LastsInTheDarkWhileInertialDataAreQuiet) {
  watch(30);
  for (int i = 0; i < 40; ++i) detector_.feel(readings(), {});
  EXPECT_TRUE(detector_.still());
  detector_.feel(readings(15), {});
  EXPECT_FALSE(detector_.still());
}

TEST(StillnessOptions, RefuseWhatMakesNoSense) {
  StillnessOptions options;
  options.velocity_sigma = 0;
  EXPECT_THROW(StillnessDetector(options, 640), InputError);
}

}  // namespace
}  // namespace rover
