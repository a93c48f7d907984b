// The steps of tracking on small made worlds.
#include <algorithm>

#include <gtest/gtest.h>

#include "rover/map/test_map.h"
#include "rover/matching/test_matcher.h"
#include "rover/tracking/frame_pose.h"
#include "rover/tracking/initial_map.h"
#include "rover/tracking/landmark_search.h"
#include "rover/tracking/local_map.h"
#include "rover/tracking/relocalizer.h"

namespace rover {
namespace {

constexpr int kPoints = 100;

SE3 pose_at(double x, double turn = 0) {
  return {so3_exp({0, turn, 0}), Eigen::Vector3d(x, 0.02, 0)};
}

double distance(const SE3& a, const SE3& b) {
  return (a.translation - b.translation).norm() + a.rotation.angularDistance(b.rotation);
}

// What the camera sees of the world of test_map(n, kPoints) from a pose.
Frame seen_from(const Map& map, const SE3& pose) {
  return test_frame(map.rig(), test_points(kPoints, 1), pose, 50);
}

std::vector<LandmarkId> all_landmarks(const Map& map) {
  std::vector<LandmarkId> ids;
  for (const Landmark& landmark : map.landmarks()) ids.push_back(landmark.id);
  return ids;
}

TEST(LandmarkSearch, FindsLandmarksAroundTheirProjection) {
  const Map map = test_map(4, kPoints);
  Frame frame = seen_from(map, pose_at(0.25));
  frame.world_from_body = pose_at(0.26, 0.002);
  const auto features = frame.features;
  std::vector<LandmarkId> sought;
  EXPECT_EQ(search_landmarks(map, all_landmarks(map), {}, FeatureGrid(*features), frame, &sought),
            kPoints);
  EXPECT_EQ(sought.size(), static_cast<std::size_t>(kPoints));
  for (int i = 0; i < kPoints; ++i) EXPECT_EQ(frame[i].landmark, LandmarkId{i});
  // A second search finds nothing that is not there already.
  EXPECT_EQ(search_landmarks(map, all_landmarks(map), {}, FeatureGrid(*features), frame), 0);
}

TEST(LandmarkSearch, LeavesWhatIsTooFarOrUnlike) {
  const Map map = test_map(4, kPoints);
  Frame frame = seen_from(map, pose_at(0.25));
  const auto features = frame.features;
  frame.world_from_body = pose_at(0.25, 0.1);  // 45 px aside
  EXPECT_LT(search_landmarks(map, all_landmarks(map), {}, FeatureGrid(*features), frame), 3);
  Frame away = seen_from(map, pose_at(0.25));
  away.world_from_body = pose_at(0.25, 3.1);
  std::vector<LandmarkId> sought;
  EXPECT_EQ(search_landmarks(map, all_landmarks(map), {}, FeatureGrid(*features), away, &sought),
            0);
  EXPECT_TRUE(sought.empty());
}

TEST(FramePose, IsFoundFromTheLandmarks) {
  for (const double baseline : {0.0, 0.1}) {
    const Map map = test_map(4, kPoints, baseline);
    Frame frame = seen_from(map, pose_at(0.25));
    for (int i = 0; i < kPoints; ++i) frame[i].landmark = {i};
    frame.world_from_body = pose_at(0.35, 0.03);
    const FramePose found = solve_frame_pose(map, {}, {}, frame);
    EXPECT_TRUE(found.estimate.converged);
    EXPECT_EQ(found.landmarks, kPoints);
    EXPECT_EQ(found.temporary, 0);
    EXPECT_LT(distance(frame.world_from_body, pose_at(0.25)), 1e-5);
  }
}

TEST(FramePose, PartsFromLandmarksThatDoNotFit) {
  const Map map = test_map(4, kPoints);
  Frame frame = seen_from(map, pose_at(0.25));
  for (int i = 0; i < kPoints; ++i) frame[i].landmark = {i < 20 ? (i + 1) % 20 : i};
  frame[99].landmark = {5000};  // gone meanwhile
  frame.world_from_body = pose_at(0.27);
  const FramePose found = solve_frame_pose(map, {}, {}, frame);
  EXPECT_EQ(found.landmarks, kPoints - 21);
  for (int i = 0; i < kPoints; ++i) {
    EXPECT_EQ(frame[i].landmark.valid(), i >= 20 && i < 99) << i;
  }
  EXPECT_LT(distance(frame.world_from_body, pose_at(0.25)), 1e-4);
}

TEST(FramePose, LeavesAFrameWithTooFewLandmarksAsItWas) {
  const Map map = test_map(4, kPoints);
  Frame frame = seen_from(map, pose_at(0.25));
  for (int i = 0; i < 3; ++i) frame[i].landmark = {i};
  frame.world_from_body = pose_at(0.3);
  EXPECT_FALSE(solve_frame_pose(map, {}, {}, frame).estimate.converged);
  EXPECT_EQ(frame.world_from_body.translation, pose_at(0.3).translation);
  EXPECT_EQ(frame.landmark_count(), 3);
}

TEST(FramePose, LeansOnTemporaryPoints) {
  const Map map = test_map(4, 10);
  const auto points = test_points(kPoints, 1);
  Frame frame = seen_from(map, pose_at(0.25));
  std::vector<TemporaryPoint> temporary;
  for (int i = 20; i < 60; ++i) temporary.push_back({points[static_cast<std::size_t>(i)], i});
  frame.world_from_body = pose_at(0.3, 0.01);
  const FramePose found = solve_frame_pose(map, {}, {}, frame, temporary);
  EXPECT_EQ(found.temporary, 40);
  EXPECT_EQ(found.landmarks, 0);
  EXPECT_LT(distance(frame.world_from_body, pose_at(0.25)), 1e-5);
}

TEST(LocalMap, FollowsTheVotes) {
  Map map = test_map(8, kPoints);
  for (int i = 0; i < 60; ++i) {  // the far end of the track sees fewer of the first
    for (int k = 5; k < 8; ++k) map.forget({i}, {k});
  }
  Frame frame = seen_from(map, pose_at(0.1));
  for (int i = 0; i < 60; ++i) frame[i].landmark = {i};
  for (int i = 0; i < 60; ++i) map.forget({i}, {i % 2 ? 0 : 1});
  LocalMapOptions options;
  const LocalMap local = choose_local_map(map, frame, {7}, options);
  EXPECT_EQ(local.reference, KeyframeId{2});  // all sixty, and the lowest id
  EXPECT_EQ(local.landmarks.size(), static_cast<std::size_t>(kPoints));
  EXPECT_TRUE(std::is_sorted(local.landmarks.begin(), local.landmarks.end()));
  clear_landmarks(frame);
  EXPECT_EQ(choose_local_map(map, frame, {7}, options).reference, KeyframeId{7});
}

TEST(LocalMap, StaysSmall) {
  auto rig = std::make_shared<const Rig>(test_rig());
  Map map({0}, rig, std::make_shared<IdSource>());
  const auto points = test_points(kPoints, 1);
  for (int k = 0; k < 10; ++k) {  // ten keyframes that have nothing in common
    const KeyframeId id = map.add_keyframe(test_frame(*rig, points, pose_at(0.1 * k), k));
    for (int i = 0; i < 5; ++i) {
      map.add_landmark(points[static_cast<std::size_t>(i)], id, i);
    }
  }
  Frame frame = seen_from(map, pose_at(0.1));
  frame[0].landmark = map.landmarks_of({2}).front();
  LocalMapOptions options;
  options.recent_keyframes = options.near_keyframes = 0;
  const LocalMap local = choose_local_map(map, frame, {2}, options);
  EXPECT_EQ(local.reference, KeyframeId{2});
  EXPECT_LE(local.landmarks.size(), 15u);  // its own, its parent's and its child's
  EXPECT_GE(local.landmarks.size(), 5u);
  options.recent_keyframes = 1;
  EXPECT_GT(choose_local_map(map, frame, {2}, options).landmarks.size(), local.landmarks.size());
}

// Two keyframes at one place, much later than each other, that share nothing; and others elsewhere.
TEST(LocalMap, TakesInWhatWasSeenFromNearby) {
  auto rig = std::make_shared<const Rig>(test_rig());
  Map map({0}, rig, std::make_shared<IdSource>());
  const auto points = test_points(kPoints, 1);
  int next = 0;
  for (const auto& [x, turn] :
       {std::pair(0.0, 0.0), {0.5, 0.0}, {9.0, 0.0}, {0.0, 1.5}, {20.0, 0.0}, {0.1, 0.0}}) {
    const SE3 pose(so3_exp({0, turn, 0}), Eigen::Vector3d(x, 0, 0));
    Frame seen = test_frame(*rig, points, pose_at(0), next);
    seen.world_from_body = pose;
    const KeyframeId id = map.add_keyframe(std::move(seen));
    map.add_landmark(points[static_cast<std::size_t>(next)], id, next);
    ++next;
  }
  Frame frame = seen_from(map, pose_at(0.1));
  frame[5].landmark = map.landmarks_of({5}).front();
  LocalMapOptions options;
  options.recent_keyframes = 0;
  const auto holds = [&](const LocalMap& local, int keyframe) {
    return std::ranges::count(local.landmarks, map.landmarks_of({keyframe}).front()) == 1;
  };
  const LocalMap local = choose_local_map(map, frame, {5}, options);
  EXPECT_TRUE(holds(local, 0));
  EXPECT_TRUE(holds(local, 1));
  EXPECT_FALSE(holds(local, 2));  // 9 m away, where what is seen is 4 m away
  EXPECT_FALSE(holds(local, 3));  // looks aside
  options.near_keyframes = 1;
  const LocalMap nearest = choose_local_map(map, frame, {5}, options);
  EXPECT_TRUE(holds(nearest, 0));
  EXPECT_FALSE(holds(nearest, 1));
}

Relocalizer relocalizer(double matched_share = 1) {
  RelocalizationOptions options;
  options.matched_share = matched_share;
  return {std::make_shared<EqualDescriptorMatcher>(), options, {}, {}, 1};
}

TEST(Relocalizer, FindsAFrameWithoutAnyPrediction) {
  const Map map = test_map(5, kPoints);
  Frame frame = seen_from(map, pose_at(0.5, -0.2));
  frame.world_from_body = SE3(so3_exp({0, 2, 0}), Eigen::Vector3d(9, 9, 9));
  ASSERT_TRUE(relocalizer().locate(map, {2}, frame));
  EXPECT_LT(distance(frame.world_from_body, pose_at(0.5, -0.2)), 1e-4);
  EXPECT_EQ(frame.landmark_count(), kPoints);
}

TEST(Relocalizer, MatchesOnlyAShareOfTheFeatures) {
  const Map map = test_map(5, kPoints);
  Frame frame = seen_from(map, pose_at(0.5, -0.2));
  ASSERT_TRUE(relocalizer(0.5).locate(map, {2}, frame));
  EXPECT_LT(distance(frame.world_from_body, pose_at(0.5, -0.2)), 1e-4);
  EXPECT_EQ(frame.landmark_count(), kPoints / 2);
}

TEST(Relocalizer, BearsWrongMatches) {
  const Map map = test_map(5, kPoints);
  Frame frame = seen_from(map, pose_at(0.5, -0.2));
  Random random(3);
  auto features = std::make_shared<FeatureSet>(*frame.features);
  for (std::size_t i = 0; i < 40; ++i) {
    features->positions[i] = {static_cast<float>(random.uniform(0, 640)),
                              static_cast<float>(random.uniform(0, 480))};
  }
  frame.features = features;
  ASSERT_TRUE(relocalizer().locate(map, {2}, frame));
  EXPECT_LT(distance(frame.world_from_body, pose_at(0.5, -0.2)), 1e-3);
  EXPECT_GE(frame.landmark_count(), 60);
  EXPECT_LE(frame.landmark_count(), 65);
}

TEST(Relocalizer, LeavesAStrangerAsItWas) {
  const Map map = test_map(5, kPoints);
  Frame frame = test_frame(map.rig(), test_points(kPoints, 77), pose_at(0.1), 50);
  frame.world_from_body = pose_at(3);
  for (int i = 0; i < 9; ++i) frame[i].landmark = {i};
  EXPECT_FALSE(relocalizer().locate(map, {2}, frame));
  EXPECT_EQ(frame.landmark_count(), 0);
  EXPECT_EQ(frame.world_from_body.translation, pose_at(3).translation);
}

std::vector<Eigen::Vector3d> plane_points(int count) {
  auto points = test_points(count, 1);
  for (auto& point : points) point.z() = 4 + 0.4 * point.x() - 0.3 * point.y();
  return points;
}

class TwoViews : public ::testing::Test {
 protected:
  std::optional<InitialViews> offer(const std::vector<Eigen::Vector3d>& points, const SE3& pose) {
    Frame frame = test_frame(*rig_, points, pose, next_++);
    return initializer_.offer(std::move(frame));
  }

  std::shared_ptr<const Rig> rig_ = std::make_shared<const Rig>(test_rig());
  MonoInitializer initializer_{rig_, std::make_shared<EqualDescriptorMatcher>(), {}, 1};
  std::int64_t next_ = 0;
};

TEST_F(TwoViews, BeginAMapOnceThereIsParallax) {
  const auto points = test_points(150, 1);
  EXPECT_FALSE(offer(points, SE3()));
  EXPECT_FALSE(offer(points, pose_at(0.02)));
  const SE3 pose = pose_at(0.4, -0.05);
  const auto views = offer(points, pose);
  ASSERT_TRUE(views);
  EXPECT_EQ(initializer_.take_pending().size(), 1u);
  const SE3 found = views->second.world_from_body;
  EXPECT_LT((found.translation - pose.translation.normalized()).norm(), 0.01);
  EXPECT_LT(found.rotation.angularDistance(pose.rotation), 0.002);
  EXPECT_GT(views->points.size(), 140u);

  Map map({0}, rig_, std::make_shared<IdSource>());
  const KeyframeId second = build_initial_map(map, *views, 50, {}, {}, {});
  ASSERT_TRUE(second.valid());
  EXPECT_TRUE(is_consistent(map));
  EXPECT_EQ(map.keyframes().size(), 2u);
  EXPECT_GT(map.landmarks().size(), 140u);
  std::vector<double> depths;
  for (const Landmark& landmark : map.landmarks()) depths.push_back(landmark.position.norm());
  std::nth_element(depths.begin(), depths.begin() + 70, depths.end());
  EXPECT_NEAR(depths[70], 1, 0.03);
  EXPECT_NEAR(map.at(second).world_from_body().translation.norm(), 0.4 / 4.1, 0.01);
}

TEST_F(TwoViews, BeginNoMapOfTooFewLandmarks) {
  const auto points = test_points(150, 1);
  EXPECT_FALSE(offer(points, SE3()));
  const auto views = offer(points, pose_at(0.4));
  ASSERT_TRUE(views);
  Map map({0}, rig_, std::make_shared<IdSource>());
  EXPECT_FALSE(build_initial_map(map, *views, 1000, {}, {}, {}).valid());
}

TEST_F(TwoViews, BeginNoMapWithoutParallax) {
  const auto points = test_points(150, 1);
  for (int i = 0; i < 8; ++i) EXPECT_FALSE(offer(points, pose_at(0.004 * i)));
  EXPECT_EQ(initializer_.take_pending().size(), 7u);
}

TEST_F(TwoViews, BeginNoMapByTurning) {
  const auto points = test_points(150, 1);
  for (int i = 0; i < 8; ++i) {
    EXPECT_FALSE(offer(points, SE3(so3_exp({0, 0.02 * i, 0}), Eigen::Vector3d::Zero()))) << i;
  }
}

TEST_F(TwoViews, OfAPlaneBeginTheRightMapOrNone) {
  const auto points = plane_points(150);
  int begun = 0;
  for (int i = 0; i < 8; ++i) {
    initializer_.reset();
    const SE3 pose(so3_exp({0.01, -0.05 * i, 0.02}), Eigen::Vector3d(0.4 * i, 0.05, 0.1 * i));
    EXPECT_FALSE(offer(points, SE3()));
    const auto views = offer(points, pose);
    if (!views) continue;
    ++begun;
    const SE3 found = views->second.world_from_body;
    EXPECT_LT((found.translation - pose.translation.normalized()).norm(), 0.03) << i;
  }
  EXPECT_GT(begun, 0);
}

TEST_F(TwoViews, NeedFeatures) {
  const auto few = test_points(90, 1);
  EXPECT_FALSE(offer(few, SE3()));
  EXPECT_FALSE(offer(few, pose_at(0.4)));
  EXPECT_EQ(initializer_.take_pending().size(), 2u);
}

TEST_F(TwoViews, GiveUpAReferenceThatIsTooOld) {
  const auto points = test_points(150, 1);
  EXPECT_FALSE(offer(points, SE3()));
  next_ = 200;
  EXPECT_FALSE(offer(points, pose_at(0.4)));  // becomes the reference
  EXPECT_TRUE(offer(points, pose_at(0.8)));
}

}  // namespace
}  // namespace rover
