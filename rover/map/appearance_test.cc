#include "rover/map/appearance.h"

#include <gtest/gtest.h>

#include "rover/map/test_map.h"
#include "rover/map/test_wall.h"

namespace rover {
namespace {

// The world is the reference camera's frame.
Landmark landmark_on(const cv::Mat& wall) {
  Frame frame = test_frame({{kWallCamera}, {SE3()}}, {kWallPoint}, SE3(), 1);
  frame.image = wall;
  Landmark landmark;
  landmark.position = kWallPoint;
  landmark.appearance = make_appearance(kWallCamera, frame, 0);
  return landmark;
}

Observation observation_at(const Eigen::Vector2f& pixel) { return {{}, pixel, 1, false, false}; }

TEST(SlantedWarp, IsThatOfThePlane) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    const Eigen::Vector2d slant(random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5));
    const Wall wall(seed, slant);
    const Landmark landmark = landmark_on({});  // a warp needs no patch
    const SE3 there = view_from(random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4),
                                random.uniform(-0.5, 0.5), random.uniform(-0.2, 0.2));
    const auto warp = slanted_warp(landmark, kWallCamera, there.inverse());
    const Eigen::Vector2d center = kWallCamera.project(kWallPoint).value();
    const auto moved = [&](const Eigen::Vector2d& offset) {
      return kWallCamera.project(there.inverse() * wall.hit(SE3(), center + offset)).value();
    };
    Eigen::Matrix2d expected;
    expected << moved({1, 0}) - moved({0, 0}), moved({0, 1}) - moved({0, 0});
    ASSERT_TRUE(warp);
    EXPECT_LT((warp->at(slant.cast<float>()).cast<double>() - expected).norm(), 0.01) << seed;
  }
}

TEST(RefineObservation, StartsWhereTheLandmarkIsExpected) {
  const SE3 there = view_from(0.1, 0, 0, 0.05);
  int expected = 0, detected = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const Wall wall(seed, {0, 0});
    Landmark landmark = landmark_on(wall.seen_from(SE3(), 1));
    const cv::Mat image = wall.seen_from(there, 2);
    const Eigen::Vector2d truth = kWallCamera.project(there.inverse() * kWallPoint).value();
    const auto finds = [&](const Eigen::Vector2d& detection) {
      Observation observation = observation_at(detection.cast<float>());
      return refine_observation(landmark, kWallCamera, there.inverse(), image, {}, observation) &&
             observation.refined && (observation.pixel.cast<double>() - truth).norm() < 0.15;
    };
    expected += finds(truth + Eigen::Vector2d(1.5, -1.5));
    landmark.position += Eigen::Vector3d(0.05, 0, 0);  // 6 px off: only the feature is left
    detected += finds(truth + Eigen::Vector2d(0.3, -0.3));
  }
  EXPECT_GE(expected, 47);
  EXPECT_GE(detected, 45);
}

TEST(LearnSlant, ComesToThePlaneOverSeveralViews) {
  int close = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const Eigen::Vector2d slant(0.8, -0.5);
    const Wall wall(seed, slant);
    Landmark landmark = landmark_on(wall.seen_from(SE3(), 1));
    int views = 0;
    for (const double x : {0.15, -0.3, 0.45, -0.6}) {
      const SE3 there = view_from(x, -0.7 * x, 0, -0.4 * x);
      const Eigen::Vector2f place =
          kWallCamera.project(there.inverse() * kWallPoint).value().cast<float>();
      const auto learned =
          learn_slant(landmark, kWallCamera, there.inverse(), wall.seen_from(there, 3), {},
                      observation_at(place + Eigen::Vector2f(0.5f, 0.5f)));
      if (!learned) continue;
      landmark.slant = *learned;
      ++views;
    }
    EXPECT_GE(views, 2) << seed;
    close += (landmark.slant.mean.cast<double>() - slant).norm() < 0.1;
  }
  EXPECT_GE(close, 28);
}

TEST(LearnSlant, TellsNothingWithoutPatchImageOrParallax) {
  const Wall wall(1, {0, 0});
  Landmark landmark = landmark_on(wall.seen_from(SE3(), 1));
  const SE3 there = view_from(0.3, 0, 0, -0.1);
  const cv::Mat image = wall.seen_from(there, 2);
  const Eigen::Vector2d place = kWallCamera.project(there.inverse() * kWallPoint).value();
  const Observation seen = observation_at(place.cast<float>());
  const auto learned = [&](const SE3& pose, const cv::Mat& from, const Observation& observation) {
    return learn_slant(landmark, kWallCamera, pose.inverse(), from, {}, observation).has_value();
  };
  ASSERT_TRUE(learned(there, image, seen));
  EXPECT_FALSE(learned(there, cv::Mat(), seen));
  const Observation off = observation_at((place + Eigen::Vector2d(4, 0)).cast<float>());
  EXPECT_FALSE(learned(there, image, off)) << "not refined, and far from where it is expected";
  const Observation here = observation_at(kWallCamera.project(kWallPoint).value().cast<float>());
  EXPECT_FALSE(learned(SE3(), wall.seen_from(SE3(), 2), here)) << "the reference itself";
  auto bare = std::make_shared<Appearance>(*landmark.appearance);
  bare->has_patch = false;
  landmark.appearance = bare;
  EXPECT_FALSE(learned(there, image, seen));
}

}  // namespace
}  // namespace rover
