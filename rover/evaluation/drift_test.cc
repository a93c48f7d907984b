#include "rover/evaluation/drift.h"

#include <gtest/gtest.h>

#include "rover/evaluation/judgement.h"

namespace rover {
namespace {

// A winding way, 10 poses per second; the reference knows seconds [0, 10] and [60, 70] only.
Eigen::Vector3d place(double t) {
  return {3 * std::cos(0.5 * t), 2 * std::sin(0.8 * t), 0.3 * std::sin(t)};
}

Trajectory path(bool blind, double scale, const Eigen::Vector3d& shift_at_end) {
  Trajectory trajectory;
  for (int i = 0; i <= 700; ++i) {
    const double t = 0.1 * i;
    if (blind && t > 10.05 && t < 59.95) continue;
    const Eigen::Vector3d shift = t > 30 ? shift_at_end : Eigen::Vector3d::Zero();
    trajectory.push_back(
        {from_seconds(t), SE3(Eigen::Quaterniond::Identity(), scale * (place(t) + shift))});
  }
  return trajectory;
}

TEST(Drift, IsTheErrorAtTheEndOfWhatIsAlignedAtTheBeginning) {
  const Trajectory reference = path(true, 1, {0, 0, 0});
  const Eigen::Vector3d shift(0.3, 0, 0.4);
  const Judgement judgement =
      judge("drifted", path(false, 0.5, shift), reference, 0.02, std::nullopt);
  ASSERT_TRUE(judgement.similarity && judgement.similarity->drift);
  const Drift& drift = *judgement.similarity->drift;
  EXPECT_NEAR(drift.position.rmse, 0.5, 1e-6);
  EXPECT_EQ(drift.position.count, 101u);
  EXPECT_NEAR(drift.blind, 50, 1e-9);
  double length = 0;
  const Trajectory whole = path(false, 1, shift);
  for (std::size_t i = 1; i < whole.size(); ++i) {
    length += (whole[i].pose.translation - whole[i - 1].pose.translation).norm();
  }
  EXPECT_NEAR(drift.path, length, 1e-6);
  EXPECT_NEAR(drift.percent, 50 / length, 1e-6);
  EXPECT_GT(judgement.rigid->drift->position.rmse, 0.5);  // which may not scale
}

TEST(Drift, IsNotToldWhereTheReferenceIsWhole) {
  const Trajectory whole = path(false, 1, {0, 0, 0});
  const Judgement judgement = judge("whole", whole, whole, 0.02, std::nullopt);
  EXPECT_FALSE(judgement.rigid->drift);
  Trajectory lost = whole;  // gaps of the estimate are another matter
  lost.erase(lost.begin() + 100, lost.begin() + 600);
  EXPECT_FALSE(judge("lost", lost, whole, 0.02, std::nullopt).rigid->drift);
}

TEST(Drift, NeedsBothEnds) {
  const Trajectory reference = path(true, 1, {0, 0, 0});
  Trajectory estimate = path(false, 1, {0, 0, 0});
  estimate.resize(500);
  EXPECT_FALSE(judge("begins", estimate, reference, 0.02, std::nullopt).rigid->drift);
  const BlindStretch stretch{from_seconds(10), from_seconds(60)};
  EXPECT_FALSE(measure_drift(estimate, associate(estimate, reference, 0.02), stretch,
                             AlignmentKind::kRigid));
}

}  // namespace
}  // namespace rover
