#include "rover/cli/input_troubles.h"

#include <gmock/gmock.h>

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr Timestamp kMs = 1'000'000;

// Images at 20 Hz, samples at 200 Hz.
class InputTroublesTest : public ::testing::Test {
 protected:
  void offer(int image, bool with_samples = true) {
    SensorFrame frame;
    frame.time = image * 50 * kMs;
    for (; next_sample_ <= frame.time; next_sample_ += 5 * kMs) {
      ImuSample sample;
      sample.time = next_sample_;
      if (with_samples) frame.imu.push_back(sample);
    }
    troubles_.offer(frame);
  }
  InputTroubles troubles_{0.025};
  Timestamp next_sample_ = 0;
};

TEST_F(InputTroublesTest, SaysNothingOfGoodInput) {
  for (int i = 0; i < 40; ++i) offer(i);
  EXPECT_THAT(troubles_.lines(), IsEmpty());
  EXPECT_EQ(troubles_.describe()["missing_images"], 0);
}

TEST_F(InputTroublesTest, CountsEveryThirdImage) {
  for (int i = 0; i < 60; ++i) {
    if (i % 3 != 2) offer(i);
  }
  EXPECT_THAT(troubles_.lines(), ElementsAre(HasSubstr("19 images are missing")));
}

TEST_F(InputTroublesTest, FindsGapsAndTheEndOfInertialData) {
  for (int i = 0; i < 80; ++i) offer(i, i < 20 || (i >= 30 && i < 60));
  EXPECT_THAT(troubles_.lines(),
              ElementsAre(AllOf(HasSubstr("1 gap(s)"), HasSubstr("0.505 s")),
                          AllOf(HasSubstr("ended at 2.950000000"), HasSubstr("1.00 s"))));
  EXPECT_EQ(troubles_.describe()["imu_gaps"].size(), 1u);
}

TEST_F(InputTroublesTest, TellsTimesWithoutVision) {
  TrackingResult result;
  EXPECT_EQ(troubles_.hear(result), "");
  result.gap = VisionGap{1000 * kMs, 2500 * kMs, 29, SE3(so3_exp({0, 0, 0.01}), {0.03, 0.04, 0})};
  EXPECT_EQ(troubles_.hear(result),
            "vision lost at 1.000000000 s for 1.50 s; inertial data carried on; drift over the gap "
            "0.050 m, 0.57 deg");
  const auto gap = troubles_.describe()["vision_gaps"][0];
  EXPECT_EQ(gap["frames"], 29);
  EXPECT_NEAR(gap["drift_m"].get<double>(), 0.05, 1e-9);
}

TEST_F(InputTroublesTest, CountsImagesThatWereOfNoUse) {
  TrackingResult result;
  result.repeated = true;
  troubles_.hear(result);
  result.left_out = true;
  troubles_.hear(result);
  troubles_.refuse_sample();
  EXPECT_THAT(troubles_.lines(),
              ElementsAre(HasSubstr("2 images repeated"), HasSubstr("1 images were left out"),
                          HasSubstr("1 inertial samples")));
}

}  // namespace
}  // namespace rover
