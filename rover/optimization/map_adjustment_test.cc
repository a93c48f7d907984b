#include "rover/optimization/map_adjustment.h"

#include <gtest/gtest.h>

#include "rover/map/test_map.h"

namespace rover {
namespace {

double error_of(const Map& map, const Landmark& landmark, KeyframeId keyframe, int feature) {
  const Frame& frame = map.at(keyframe).frame;
  const auto pixel =
      map.rig().cameras[0].project(frame.world_from_body.inverse() * landmark.position);
  return pixel ? (*pixel - frame[feature].pixel.cast<double>()).norm() : 1e9;
}

double mean_error(const Map& map) {
  double sum = 0;
  int count = 0;
  for (const Landmark& landmark : map.landmarks()) {
    for (const auto& [keyframe, feature] : landmark.observations) {
      sum += error_of(map, landmark, keyframe, feature);
      ++count;
    }
  }
  return sum / count;
}

SE3 random_motion(Random& random, double metres, double radians) {
  Vector6d tangent;
  for (int i = 0; i < 6; ++i) tangent[i] = (i < 3 ? metres : radians) * random.gaussian();
  return se3_exp(tangent);
}

// Moves all keyframes but the first one, and all landmarks.
void disturb(Map& map, double metres, double radians, std::uint64_t seed = 3) {
  Random random(seed);
  std::vector<KeyframeId> keyframes;
  for (const Keyframe& keyframe : map.keyframes()) keyframes.push_back(keyframe.id);
  for (std::size_t i = 1; i < keyframes.size(); ++i) {
    const SE3 pose = map.at(keyframes[i]).world_from_body();
    map.set_pose(keyframes[i], pose * random_motion(random, metres, radians));
  }
  std::vector<LandmarkId> landmarks;
  for (const Landmark& landmark : map.landmarks()) landmarks.push_back(landmark.id);
  for (const LandmarkId id : landmarks) {
    const Eigen::Vector3d noise(random.gaussian(), random.gaussian(), random.gaussian());
    map.set_position(id, map.at(id).position + metres * noise);
  }
}

BundleSummary untouched(const MapProblem& problem) {
  BundleSummary summary;
  summary.usable = true;
  summary.inliers.assign(problem.bundle.observations.size(), 1);
  return summary;
}

// A summary that finds the observations of one landmark in one keyframe wrong.
BundleSummary with_outlier(const MapProblem& problem, LandmarkId landmark, KeyframeId keyframe,
                           int camera) {
  BundleSummary summary = untouched(problem);
  for (std::size_t i = 0; i < summary.inliers.size(); ++i) {
    const BundleObservation& observation = problem.bundle.observations[i];
    summary.inliers[i] =
        problem.landmarks[static_cast<std::size_t>(observation.point)] != landmark ||
        problem.keyframes[static_cast<std::size_t>(observation.pose)] != keyframe ||
        observation.camera != camera;
  }
  return summary;
}

// A keyframe made of the same world, which sees the map's landmarks and so becomes a newcomer.
KeyframeId add_newcomer(Map& map, int points, std::int64_t index, double x) {
  const SE3 pose(so3_exp({0, 0.02, 0}), Eigen::Vector3d(x, 0.01, 0));
  Frame frame = test_frame(map.rig(), test_points(points, 1), pose, index);
  for (int i = 0; i < points; i += 2) frame[i].landmark = {i};
  return map.add_keyframe(std::move(frame));
}

TEST(MapAdjustment, AnUntouchedProblemChangesNothing) {
  Map map = test_map(5, 40);
  const Map before = map;
  const MapProblem problem = gather_whole_map(map, {});
  EXPECT_EQ(problem.keyframes.size(), 5u);
  EXPECT_EQ(problem.landmarks.size(), 40u);
  EXPECT_EQ(problem.bundle.observations.size(), 200u);
  commit_adjustment(map, problem, untouched(problem));
  EXPECT_TRUE(is_consistent(map));
  for (const Keyframe& keyframe : map.keyframes()) {
    EXPECT_EQ(keyframe.world_from_body().translation,
              before.at(keyframe.id).world_from_body().translation);
    EXPECT_EQ(keyframe.frame.landmark_count(), 40);
  }
  for (const Landmark& landmark : map.landmarks()) {
    EXPECT_EQ(landmark.position, before.at(landmark.id).position);
  }
}

TEST(MapAdjustment, FixesTheOldestKeyframeOfTheWholeMap) {
  const MapProblem problem = gather_whole_map(test_map(4, 30), {});
  EXPECT_EQ(problem.bundle.pose_fixed, (std::vector<char>{1, 0, 0, 0}));
  EXPECT_TRUE(problem.needs_scale);
  EXPECT_FALSE(gather_whole_map(test_map(4, 30, 0.1), {}).needs_scale);
}

TEST(MapAdjustment, FixesTheKeyframesAroundAWindow) {
  const Map map = test_map(6, 30);
  const MapProblem problem = gather_problem(map, {{4}, {5}}, 3, {});
  ASSERT_EQ(problem.keyframes.size(), 5u);
  EXPECT_EQ(problem.bundle.pose_fixed, (std::vector<char>{0, 0, 1, 1, 1}));
  EXPECT_FALSE(problem.needs_scale);
  const MapProblem alone = gather_problem(map, {{4}, {5}}, 0, {});
  EXPECT_EQ(alone.bundle.pose_fixed, (std::vector<char>{1, 0}));
  EXPECT_TRUE(alone.needs_scale);
}

TEST(MapAdjustment, WeighsByNoiseAndModel) {
  const WeightingOptions weighting{.model_sigma = 4, .detection_sigma = 7.2, .disparity_sigma = 4};
  Observation observation;
  observation.sigma = 3;
  EXPECT_DOUBLE_EQ(effective_sigma(observation, weighting), 7.8);
  observation.refined = true;
  EXPECT_DOUBLE_EQ(effective_sigma(observation, weighting), 5);
  EXPECT_DOUBLE_EQ(effective_disparity_sigma(3, weighting), 5);
  const WeightingOptions detected{.detection_sigma = 1.2, .disparity_sigma = 1.2};
  const MapProblem problem = gather_whole_map(test_map(3, 30), detected);
  for (const auto& seen : problem.bundle.observations) {
    EXPECT_NEAR(seen.sigma, 1.3, 1e-9);  // 0.5 px of its own
  }
  const MapProblem stereo = gather_whole_map(test_map(3, 30, 0.1), detected);
  for (const auto& seen : stereo.bundle.observations) EXPECT_NEAR(seen.sigma, 1.3, 1e-9);
}

// Refined, an observation is of another point of the patch, and its partner with it.
TEST(MapAdjustment, RefinementLeavesTheDisparity) {
  Map map = test_map(3, 30, 0.1);
  const MapProblem before = gather_whole_map(map, {});
  map.set_measurement({1}, 7, map.at(KeyframeId{1}).frame[7].pixel + Eigen::Vector2f(0.7f, -0.4f),
                      0.1f);
  const MapProblem after = gather_whole_map(map, {});
  ASSERT_EQ(before.bundle.observations.size(), after.bundle.observations.size());
  int moved = 0, disparities = 0;
  for (std::size_t i = 0; i < after.bundle.observations.size(); ++i) {
    const BundleObservation& now = after.bundle.observations[i];
    const double change = (now.pixel - before.bundle.observations[i].pixel).norm();
    moved += change > 0;
    if (now.camera != kDisparity) continue;
    EXPECT_EQ(change, 0);
    ++disparities;
  }
  EXPECT_EQ(moved, 1);
  EXPECT_EQ(disparities, 90);
}

TEST(MapAdjustment, RepairsADisturbedMap) {
  for (const double baseline : {0.0, 0.1}) {
    Map map = test_map(6, 80, baseline);
    disturb(map, 0.01, 0.002);
    const double before = mean_error(map);
    EXPECT_GT(before, 0.5);
    MapProblem problem = gather_whole_map(map, {});
    BundleOptions options;
    options.first_iterations = 20;
    const BundleSummary summary = adjust(problem, options);
    ASSERT_TRUE(summary.usable);
    commit_adjustment(map, problem, summary);
    EXPECT_LT(mean_error(map), 0.02) << baseline;
    EXPECT_TRUE(is_consistent(map));
    EXPECT_EQ(map.landmarks().size(), 80u);
  }
}

TEST(MapAdjustment, RemovesObservationsThatAreWrong) {
  Map map = test_map(6, 80);
  const KeyframeId observer{3};
  const LandmarkId wrong{7};
  map.set_measurement(observer, 7, map.at(observer).frame[7].pixel + Eigen::Vector2f(25, -18),
                      0.5f);
  MapProblem problem = gather_whole_map(map, {});
  commit_adjustment(map, problem, adjust(problem, {}));
  EXPECT_FALSE(map.at(wrong).has_observation(observer));
  EXPECT_FALSE(map.at(observer).frame[7].landmark.valid());
  EXPECT_EQ(map.at(wrong).observations.size(), 5u);
  EXPECT_EQ(map.at(observer).frame.landmark_count(), 79);
  EXPECT_TRUE(is_consistent(map));
}

TEST(MapAdjustment, RemovesLandmarksLeftWithOneView) {
  Map map = test_map(2, 30);
  const MapProblem problem = gather_whole_map(map, {});
  commit_adjustment(map, problem, with_outlier(problem, {4}, {1}, 0));
  EXPECT_EQ(map.find(LandmarkId{4}), nullptr);
  EXPECT_EQ(map.landmarks().size(), 29u);
  EXPECT_TRUE(is_consistent(map));
}

TEST(MapAdjustment, AWrongStereoPartnerLeavesTheObservation) {
  Map map = test_map(3, 30, 0.1);
  const MapProblem problem = gather_whole_map(map, {});
  commit_adjustment(map, problem, with_outlier(problem, {4}, {1}, kDisparity));
  EXPECT_TRUE(map.at(KeyframeId{1}).frame[4].stereo_rejected);
  EXPECT_TRUE(map.at(LandmarkId{4}).has_observation({1}));
  EXPECT_FALSE(map.at(KeyframeId{1}).frame[5].stereo_rejected);
  const MapProblem next = gather_whole_map(map, {});
  EXPECT_EQ(next.bundle.observations.size(), problem.bundle.observations.size() - 1);
}

TEST(MapAdjustment, NewcomersMoveWithTheirParents) {
  Random random(5);
  Map map = test_map(4, 40);
  MapProblem problem = gather_whole_map(map, {});
  const KeyframeId child = add_newcomer(map, 40, 4, 0.45);
  const KeyframeId grandchild = add_newcomer(map, 40, 5, 0.55);
  const Eigen::Vector3d own = test_points(40, 1)[1];
  const LandmarkId young = map.add_landmark(own, child, 1);
  ASSERT_TRUE(map.observe(young, grandchild, 1));
  // One rigid motion of all that was gathered.
  const SE3 correction = random_motion(random, 0.3, 0.2);
  for (SE3& pose : problem.bundle.world_from_body) pose = correction * pose;
  for (Eigen::Vector3d& point : problem.bundle.points) point = correction * point;
  std::fill(problem.bundle.pose_fixed.begin(), problem.bundle.pose_fixed.end(), 0);
  commit_adjustment(map, problem, untouched(problem));
  EXPECT_LT((map.at(young).position - correction * own).norm(), 1e-9);
  EXPECT_LT(mean_error(map), 1e-3);
  EXPECT_GT((map.at(child).world_from_body().translation - Eigen::Vector3d(0.45, 0.01, 0)).norm(),
            0.01);
  EXPECT_TRUE(is_consistent(map));
}

TEST(MapAdjustment, WhatHasGoneMeanwhileIsPassedOver) {
  Map map = test_map(5, 40);
  disturb(map, 0.005, 0.001);
  MapProblem problem = gather_whole_map(map, {});
  map.retire({2});
  map.remove(LandmarkId{3});
  map.fuse({5}, {6});
  map.forget({8}, {1});
  commit_adjustment(map, problem, adjust(problem, {}));
  EXPECT_EQ(map.find(KeyframeId{2}), nullptr);
  EXPECT_EQ(map.find(LandmarkId{3}), nullptr);
  EXPECT_FALSE(map.at(LandmarkId{8}).has_observation({1}));
  EXPECT_TRUE(is_consistent(map));
}

TEST(MapAdjustment, AnotherEpochDiscardsTheCommit) {
  Map map = test_map(4, 40);
  MapProblem problem = gather_whole_map(map, {});
  for (Eigen::Vector3d& point : problem.bundle.points) point *= 2;
  Sim3 gauge;
  gauge.scale = 1.5;
  map.transform(gauge);
  const Map before = map;
  commit_adjustment(map, problem, with_outlier(problem, {4}, {1}, 0));
  EXPECT_EQ(map.at(LandmarkId{4}).observations.size(), 4u);
  for (const Landmark& landmark : map.landmarks()) {
    EXPECT_EQ(landmark.position, before.at(landmark.id).position);
  }
}

TEST(MapAdjustment, AnUnusableResultIsDiscarded) {
  Map map = test_map(3, 30);
  MapProblem problem = gather_whole_map(map, {});
  for (Eigen::Vector3d& point : problem.bundle.points) point *= 2;
  BundleSummary summary = with_outlier(problem, {4}, {1}, 0);
  summary.usable = false;
  commit_adjustment(map, problem, summary);
  EXPECT_LT(mean_error(map), 1e-3);
  EXPECT_EQ(map.at(LandmarkId{4}).observations.size(), 3u);
}

}  // namespace
}  // namespace rover
