#include "rover/mapping/slant_learning.h"

#include <gtest/gtest.h>

#include "rover/map/test_map.h"
#include "rover/map/test_wall.h"

namespace rover {
namespace {

const Eigen::Vector2d kSlant(0.7, -0.4);
constexpr double kDetectionError = 0.5;  // px, along both axes

// A wall that leans, its points seen by a keyframe that faces the camera and by one from the side,
// where detections are off.
struct Scene {
  Wall wall{5, kSlant};
  SE3 there = view_from(0.5, -0.2, 0, -0.2);
  std::vector<Eigen::Vector3d> points;
  Map map;
  KeyframeId reference, side;

  Scene()
      : map({1}, std::make_shared<const Rig>(Rig{{kWallCamera}, {SE3()}}),
            std::make_shared<IdSource>()) {
    for (int x = 60; x <= 140; x += 20) {
      for (int y = 50; y <= 110; y += 20) points.push_back(wall.hit(SE3(), Eigen::Vector2d(x, y)));
    }
    Frame frame = test_frame(map.rig(), points, SE3(), 1);
    frame.image = wall.seen_from(SE3(), 1);
    reference = map.add_keyframe(frame);
    Frame from_side = test_frame(map.rig(), points, there, 2);
    from_side.image = wall.seen_from(there, 2);
    for (int i = 0; i < from_side.size(); ++i) {
      from_side[i].pixel.array() += static_cast<float>(kDetectionError);
    }
    side = map.add_keyframe(from_side);
    for (int i = 0; i < frame.size(); ++i) {
      map.observe(map.add_landmark(points[static_cast<std::size_t>(i)], reference, i), side, i);
    }
  }

  double error(int feature) const {
    const Eigen::Vector3d& point = points[static_cast<std::size_t>(feature)];
    const Eigen::Vector2d truth = kWallCamera.project(there.inverse() * point).value();
    return (map.at(side).frame[feature].pixel.cast<double>() - truth).norm();
  }
};

TEST(LearnSlants, OfAKeyframeFromTheSide) {
  Scene scene;
  scene.map.freeze();
  const Map before = scene.map;
  const auto learned = learn_slants(scene.map, scene.side, {}, {});
  ASSERT_GE(learned.size(), 15u);
  commit_slants(scene.map, scene.side, learned);
  int close = 0, exact = 0;
  for (const auto& [id, slant, feature, observed] : learned) {
    close += (scene.map.at(id).slant.mean.cast<double>() - kSlant).norm() < 0.25;
    exact += scene.map.at(scene.side).frame[feature].refined && scene.error(feature) < 0.15;
    EXPECT_TRUE(before.at(id).slant.mean.isZero()) << "an earlier view of the map has changed";
  }
  EXPECT_GE(close, 14);
  EXPECT_GE(exact, 14);
  EXPECT_TRUE(learn_slants(scene.map, scene.reference, {}, {}).empty()) << "where patches are from";
}

TEST(LearnSlants, OfLandmarksGoneMeanwhileAreDropped) {
  Scene scene;
  const auto learned = learn_slants(scene.map, scene.side, {}, {});
  ASSERT_GE(learned.size(), 2u);
  scene.map.remove(learned[0].landmark);
  scene.map.forget(learned[1].landmark, scene.side);
  commit_slants(scene.map, scene.side, learned);
  EXPECT_FALSE(scene.map.at(scene.side).frame[learned[0].feature].refined);
  EXPECT_FALSE(scene.map.at(scene.side).frame[learned[1].feature].refined);
  EXPECT_TRUE(scene.map.at(learned[1].landmark).slant.mean.isZero());
}

}  // namespace
}  // namespace rover
