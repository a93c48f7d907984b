#include "rover/optimization/inertial_map_adjustment.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "rover/map/test_map.h"
#include "rover/optimization/simulated_map.h"

namespace rover {
namespace {

constexpr int kAll = 1000;  // more keyframes than any of these maps has

SimulatedFlight flight_of(int keyframes) {
  return simulate_flight({.keyframes = keyframes, .points = 120, .imu_inflation = 8, .seed = 5});
}

// As the map is now, whatever becomes of it.
Map snapshot(Map& map) {
  Map copy = map;
  map.freeze();
  return copy;
}

// Scales and turns what a problem holds about its first camera, as a refinement may.
Sim3 scale_and_tilt(InertialMapProblem& problem, double scale) {
  BundleProblem& bundle = problem.inertial.bundle;
  const SE3& body_from_camera = bundle.rig.body_from_camera[0];
  const Eigen::Vector3d center = bundle.world_from_body[0] * body_from_camera.translation;
  const Eigen::Quaterniond tilt = so3_exp({0.02, -0.01, 0});
  const Sim3 motion(scale, tilt, center - scale * (tilt * center));
  for (SE3& pose : bundle.world_from_body)
    pose = move_pose(motion, pose * body_from_camera) * body_from_camera.inverse();
  for (Eigen::Vector3d& point : bundle.points) point = motion * point;
  return motion;
}

InertialBundleSummary all_fit(const InertialMapProblem& problem) {
  InertialBundleSummary summary;
  summary.visual.usable = true;
  summary.visual.inliers.assign(problem.inertial.bundle.observations.size(), 1);
  return summary;
}

void expect_moved(const Map& map, const Map& before, const Sim3& motion) {
  for (const Keyframe& keyframe : before.keyframes()) {
    const SE3& body_from_camera = map.rig().body_from_camera[0];
    const SE3 wanted = move_pose(motion, keyframe.world_from_body() * body_from_camera);
    const SE3 found = map.at(keyframe.id).world_from_body() * body_from_camera;
    EXPECT_LT(se3_minus(found, wanted).norm(), 1e-9) << "keyframe " << keyframe.id.value;
  }
  for (const Landmark& landmark : before.landmarks()) {
    EXPECT_LT((map.at(landmark.id).position - motion * landmark.position).norm(), 1e-9);
  }
}

TEST(InertialMapAdjustment, WhereTheBodyStoodStillItsVelocityIsNone) {
  const auto flight = flight_of(8);
  Map map = SimulatedMap(flight).make(8);
  const auto adjusted_velocity = [&](std::size_t keyframe) {
    InertialMapProblem problem = gather_newest(map, kAll, {});
    EXPECT_TRUE(adjust_inertial_bundle(problem.inertial, {}).visual.usable);
    return problem.inertial.velocity[keyframe].norm();
  };
  const double moving = adjusted_velocity(5);
  EXPECT_GT(moving, 0.1);
  map.set_still({5}, 0.0001);
  EXPECT_LT(adjusted_velocity(5), 0.1 * moving);
}

TEST(InertialMapAdjustment, WhatIsGatheredComesBack) {
  const auto flight = flight_of(8);
  Map map = SimulatedMap(flight).make(8);
  InertialMapProblem problem = gather_newest(map, kAll, {});
  EXPECT_EQ(problem.map.keyframes.size(), 8u);
  EXPECT_EQ(problem.inertial.links.size(), 7u);
  problem.inertial.velocity[3] = {1, 2, 3};
  problem.inertial.bias[3].gyroscope = {0.1, 0.2, 0.3};
  const Map before = snapshot(map);
  commit_inertial_adjustment(map, problem, all_fit(problem));
  expect_moved(map, before, Sim3());
  EXPECT_EQ(map.at(problem.map.keyframes[3]).velocity, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(map.at(problem.map.keyframes[3]).bias.gyroscope, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_TRUE(is_consistent(map));
  EXPECT_NEAR(map.scale(), 1, 1e-12);
}

TEST(InertialMapAdjustment, FixesTheStateBeforeTheWindow) {
  const auto flight = flight_of(12);
  Map map = SimulatedMap(flight).make(12);
  const InertialMapProblem problem = gather_inertial_window(map, map.newest_keyframe(), 5, 3, {});
  const auto& fixed = problem.inertial.bundle.pose_fixed;
  ASSERT_EQ(problem.map.keyframes.size(), 9u);  // window, the one before it, three others
  EXPECT_EQ(std::count(fixed.begin(), fixed.end(), 0), 5);
  EXPECT_EQ(problem.inertial.links.size(), 5u);
  for (const InertialLink& link : problem.inertial.links) {
    const KeyframeId to = problem.map.keyframes[static_cast<std::size_t>(link.to)];
    EXPECT_EQ(problem.map.keyframes[static_cast<std::size_t>(link.from)], map.at(to).previous);
  }
  InertialMapProblem moved = problem;
  for (SE3& pose : moved.inertial.bundle.world_from_body) pose.translation.x() += 1;
  const Map before = snapshot(map);
  commit_inertial_adjustment(map, moved, all_fit(moved));
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    const KeyframeId id = problem.map.keyframes[i];
    const double step = map.at(id).world_from_body().translation.x() -
                        before.at(id).world_from_body().translation.x();
    EXPECT_NEAR(step, fixed[i] ? 0 : 1, 1e-12);
  }
  EXPECT_EQ(map.scale(), 1);
}

TEST(InertialMapAdjustment, AWindowWithNothingBeforeItIsFree) {
  const auto flight = flight_of(5);
  const Map map = SimulatedMap(flight).make(5);
  const InertialMapProblem problem = gather_inertial_window(map, map.newest_keyframe(), 10, 3, {});
  const auto& fixed = problem.inertial.bundle.pose_fixed;
  EXPECT_EQ(std::count(fixed.begin(), fixed.end(), 0), 5);
  EXPECT_EQ(problem.inertial.priors.size(), 1u);  // of the biases that the chain begins with
}

// Velocity and biases, by the state, without how they turn with it about the vertical.
Eigen::Matrix<double, 9, 15> by_state_without_turn(const InertialState& state) {
  Eigen::Matrix<double, 9, 15> by_state = Eigen::Matrix<double, 9, 15>::Zero();
  by_state.rightCols<9>().setIdentity();
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  by_state.block<3, 3>(0, 3) =
      -up.cross(state.velocity) * up.transpose() * state.world_from_body.rotation_matrix();
  return by_state;
}

// What is told of tilt, scale and the rest apart is, together, what was found.
TEST(InertialMapAdjustment, TellsAllThatAFreeMapKnowsOfVelocityAndBiases) {
  for (const int cameras : {1, 2}) {
    const auto flight = simulate_flight({.cameras = cameras, .points = 120, .imu_inflation = 8});
    Map map = SimulatedMap(flight).make(12);
    InertialMapProblem problem = gather_newest(map, kAll, {});
    const auto summary =
        adjust_inertial_bundle(problem.inertial, {.covariance = true, .scale_sigma = true});
    commit_inertial_adjustment(map, problem, summary);
    const Keyframe& newest = map.at(map.newest_keyframe());
    ASSERT_TRUE(newest.covariance);
    const auto by_state = by_state_without_turn(newest.state());
    const Matrix9d told = by_state * newest.covariance->covariance() * by_state.transpose();
    const Matrix9d found = by_state * summary.covariance.back() * by_state.transpose();
    const Vector9d sigma = found.diagonal().cwiseSqrt();
    const Matrix9d off =
        sigma.asDiagonal().inverse() * (told - found) * sigma.asDiagonal().inverse();
    EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-3) << cameras << " cameras";
  }
}

// The alignment has told the keyframes before it of what came after them.
TEST(InertialMapAdjustment, AWindowThatBeginsBeforeTheAlignmentTakesNoPriorOfIt) {
  const auto flight = flight_of(12);
  Map map = SimulatedMap(flight).make(12);
  InertialMapProblem whole = gather_newest(map, kAll, {});
  const auto summary =
      adjust_inertial_bundle(whole.inertial, {.covariance = true, .scale_sigma = true});
  commit_inertial_adjustment(map, whole, summary);
  const KeyframeId border{5};
  ASSERT_TRUE(map.at(border).covariance);
  const auto knows_of_velocity = [&](Timestamp aligned) {
    map.set_inertial({.aligned = true, .begin = aligned});
    const auto problem = gather_inertial_window(map, map.newest_keyframe(), 6, 100, {});
    EXPECT_EQ(problem.map.keyframes[static_cast<std::size_t>(problem.inertial.border)], border);
    const auto prior =
        std::ranges::find(problem.inertial.priors, problem.inertial.border, &PlacedPrior::pose);
    return prior->prior.information.block<3, 3>(6, 6).trace() > 0;
  };
  EXPECT_TRUE(knows_of_velocity(map.at(border).frame.time));
  EXPECT_FALSE(knows_of_velocity(map.at(border).frame.time + 1));
}

TEST(InertialMapAdjustment, WhatIsOlderMovesAlong) {
  const auto flight = flight_of(12);
  Map map = SimulatedMap(flight).make(12);
  map.retire({2});
  InertialMapProblem problem = gather_newest(map, 6, {});
  ASSERT_EQ(problem.map.keyframes.size(), 6u);
  EXPECT_EQ(problem.map.keyframes.front(), KeyframeId{6});
  const Map before = snapshot(map);
  const SE3 retired =
      map.at(map.standing({2})).world_from_body().inverse() * map.world_from_any({2});
  const Sim3 motion = scale_and_tilt(problem, 1.02);
  commit_inertial_adjustment(map, problem, all_fit(problem));
  expect_moved(map, before, motion);
  // What hangs on keyframes follows, as it does where the whole map is transformed.
  EXPECT_NEAR(map.scale(), 1.02, 1e-9);
  Map transformed = before;
  transformed.freeze();
  transformed.transform(motion);
  EXPECT_LT(se3_minus(map.world_from_any({2}), transformed.world_from_any({2})).norm(), 1e-9);
  EXPECT_LT(
      se3_minus(map.rescale_relative(retired, {1, map.rig().body_from_camera[0]}),
                map.at(map.standing({2})).world_from_body().inverse() * map.world_from_any({2}))
          .norm(),
      1e-9);
}

TEST(InertialMapAdjustment, WhatHasComeMeanwhileMovesAlong) {
  const auto flight = flight_of(8);
  SimulatedMap simulated(flight);
  Map map = simulated.make(6);
  InertialMapProblem problem = gather_newest(map, kAll, {});
  const Sim3 motion = scale_and_tilt(problem, 0.97);
  for (int i = 6; i < 8; ++i) simulated.add(map, i);
  map.set_velocity({7}, {1, 0, 0}, {});
  const Map before = snapshot(map);
  commit_inertial_adjustment(map, problem, all_fit(problem));
  expect_moved(map, before, motion);
  EXPECT_LT(
      (map.at(KeyframeId{7}).velocity - 0.97 * (motion.rotation * Eigen::Vector3d::UnitX())).norm(),
      1e-9);
}

TEST(InertialMapAdjustment, LeavesAMapOfAnotherEpochAlone) {
  const auto flight = flight_of(6);
  Map map = SimulatedMap(flight).make(6);
  InertialMapProblem problem = gather_newest(map, kAll, {});
  scale_and_tilt(problem, 1.1);
  map.transform({2, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()});
  const Map before = snapshot(map);
  commit_inertial_adjustment(map, problem, all_fit(problem));
  expect_moved(map, before, Sim3());
  EXPECT_EQ(map.scale(), 2);
}

TEST(InertialMapAdjustment, LinksBridgeRetiredKeyframes) {
  const auto flight = flight_of(8);
  Map map = SimulatedMap(flight).make(8);
  map.retire({3});
  const InertialMapProblem problem = gather_newest(map, kAll, {});
  EXPECT_EQ(problem.map.keyframes.size(), 7u);
  ASSERT_EQ(problem.inertial.links.size(), 6u);
  EXPECT_NEAR(problem.inertial.links[2].motion.duration(), 0.5, 1e-9);
  for (const BundleObservation& seen : problem.inertial.bundle.observations) {
    EXPECT_NE(problem.map.keyframes[static_cast<std::size_t>(seen.pose)], KeyframeId{3});
  }
}

}  // namespace
}  // namespace rover
