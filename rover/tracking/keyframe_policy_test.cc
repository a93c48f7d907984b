#include "rover/tracking/keyframe_policy.h"

#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/map/test_map.h"
#include "rover/tracking/keyframe_insertion.h"

namespace rover {
namespace {

// A frame for which nothing speaks for a keyframe.
KeyframeEvidence quiet() {
  KeyframeEvidence evidence;
  evidence.inliers = 200;
  evidence.reference_landmarks = 220;
  evidence.parallax = 5;
  evidence.rotation = 2;
  evidence.frames_since_keyframe = 5;
  evidence.near_tracked = 200;
  return evidence;
}

struct Case {
  const char* name;
  void (*change)(KeyframeEvidence&);
  bool wanted;
};

constexpr Case kCases[] = {
    {"nothing has changed", [](KeyframeEvidence&) {}, false},
    {"few of the reference's landmarks", [](KeyframeEvidence& e) { e.inliers = 150; }, true},
    {"just enough of them", [](KeyframeEvidence& e) { e.inliers = 156; }, false},
    {"much parallax", [](KeyframeEvidence& e) { e.parallax = 61; }, true},
    {"a turn", [](KeyframeEvidence& e) { e.rotation = 20.5; }, true},
    {"a turn the other frame answered",
     [](KeyframeEvidence& e) { e.rotation = 20.5, e.frames_since_keyframe = 0; }, false},
    {"landmarks run out, however soon",
     [](KeyframeEvidence& e) { e.inliers = 50, e.frames_since_keyframe = 0; }, true},
    {"too few to be sure of the pose", [](KeyframeEvidence& e) { e.inliers = 14; }, false},
    {"near points run out",
     [](KeyframeEvidence& e) {
       e.stereo = true, e.near_tracked = 90, e.near_new = 80, e.frames_since_keyframe = 0;
     },
     true},
    {"near points run out, none to be had",
     [](KeyframeEvidence& e) { e.stereo = true, e.near_tracked = 90, e.near_new = 60; }, false},
    {"enough near points",
     [](KeyframeEvidence& e) { e.stereo = true, e.near_tracked = 110, e.near_new = 300; }, false},
    {"near points mean nothing to one camera",
     [](KeyframeEvidence& e) { e.near_tracked = 0, e.near_new = 300; }, false},
};

TEST(KeyframePolicy, DecidesByTheTable) {
  KeyframePolicyOptions options;
  options.min_tracked_share = 0.7;
  options.max_parallax = 60;
  options.max_rotation = 20;
  options.min_landmarks = 60;
  options.min_near = 100;
  options.min_new_near = 70;
  options.min_inliers = 15;
  options.min_gap = 1;
  for (const Case& one : kCases) {
    KeyframeEvidence evidence = quiet();
    one.change(evidence);
    EXPECT_EQ(wants_keyframe(evidence, options), one.wanted) << one.name;
  }
}

TEST(KeyframePolicy, InertialDataAreNotIntegratedForLong) {
  const KeyframePolicyOptions options;
  KeyframeEvidence evidence = quiet();
  evidence.seconds_since_keyframe = 0.5;
  EXPECT_FALSE(wants_keyframe(evidence, options));
  evidence.inertial = evidence.settled = evidence.stereo = true;
  EXPECT_TRUE(wants_keyframe(evidence, options));
  evidence.seconds_since_keyframe = 0.45;
  EXPECT_FALSE(wants_keyframe(evidence, options));
  evidence.parallax = evidence.rotation = 0.5;  // standing still
  evidence.seconds_since_keyframe = 30;
  EXPECT_FALSE(wants_keyframe(evidence, options));
}

TEST(KeyframePolicy, WhatHangsOnInertialDataTakesKeyframesCloserTogether) {
  const KeyframePolicyOptions options;
  KeyframeEvidence easy = quiet();
  easy.inliers = easy.reference_landmarks = options.sparse_landmarks;
  easy.inertial = easy.settled = easy.stereo = true;
  KeyframeEvidence uncertain = easy, mono = easy, sparse = easy;
  uncertain.settled = false;
  mono.stereo = false;
  sparse.inliers -= 1;
  const std::vector<std::pair<KeyframeEvidence, double>> cases{{easy, options.max_gap},
                                                               {uncertain, options.short_gap},
                                                               {mono, options.short_gap},
                                                               {sparse, options.sparse_gap}};
  for (auto [evidence, gap] : cases) {
    evidence.seconds_since_keyframe = gap;
    EXPECT_TRUE(wants_keyframe(evidence, options)) << gap;
    evidence.seconds_since_keyframe = gap - 0.05;
    EXPECT_FALSE(wants_keyframe(evidence, options)) << gap;
    evidence.seconds_since_keyframe = gap;
    evidence.inertial = false;
    EXPECT_FALSE(wants_keyframe(evidence, options)) << gap;
  }
}

TEST(KeyframePolicy, FadingLandmarksDoNotCrowdTheWindow) {
  const KeyframePolicyOptions options;
  KeyframeEvidence evidence = quiet();
  evidence.inliers = options.min_landmarks - 1;
  evidence.seconds_since_keyframe = 0.05;
  EXPECT_TRUE(wants_keyframe(evidence, options));
  evidence.inertial = evidence.settled = true;
  EXPECT_FALSE(wants_keyframe(evidence, options));
  evidence.seconds_since_keyframe = 0.15;
  EXPECT_TRUE(wants_keyframe(evidence, options));
}

TEST(KeyframePolicy, HoveringAndStandingStillAddNone) {
  const KeyframePolicyOptions options;
  KeyframeEvidence evidence = quiet();
  evidence.inertial = evidence.settled = true;
  evidence.parallax = evidence.rotation = 0.5;
  evidence.seconds_since_keyframe = 30;
  evidence.stereo = true;
  evidence.near_tracked = 10;
  evidence.near_new = 300;
  EXPECT_FALSE(wants_keyframe(evidence, options));
  evidence.inliers = options.min_landmarks - 1;  // what is tracked fades
  EXPECT_TRUE(wants_keyframe(evidence, options));
  evidence.still = true;
  EXPECT_FALSE(wants_keyframe(evidence, options));
}

TEST(KeyframePolicy, RefusesOptionsThatMakeNoSense) {
  KeyframePolicyOptions options;
  EXPECT_NO_THROW(options.check());
  options.min_tracked_share = 1;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.max_parallax = 0;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.min_inliers = 3;
  EXPECT_THROW(options.check(), InputError);
}

KeyframeEvidence evidence_at(const SE3& pose, double baseline = 0) {
  const Map map = test_map(4, 60, baseline);
  Frame frame = test_frame(map.rig(), test_points(60, 1), pose, 9);
  for (int i = 0; i < 45; ++i) frame[i].landmark = {i};
  return gather_keyframe_evidence(map, frame, {0}, 4.0);
}

TEST(KeyframeEvidence, TellsTurningFromMoving) {
  const auto turned = evidence_at(SE3(so3_exp({0, 0.1, 0}), Eigen::Vector3d::Zero()));
  EXPECT_NEAR(turned.rotation, 0.1 * 180 / 3.14159265358979, 1e-6);
  EXPECT_LT(turned.parallax, 0.01);
  EXPECT_EQ(turned.inliers, 45);
  EXPECT_EQ(turned.reference_landmarks, 60);
  EXPECT_FALSE(turned.stereo);
  const auto moved = evidence_at(SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.4, 0, 0)));
  EXPECT_NEAR(moved.rotation, 0, 1e-6);
  EXPECT_NEAR(moved.parallax, 450 * 0.4 / 4, 12);  // points lie 3 to 5 m away
}

TEST(KeyframeEvidence, CountsNearStereoPoints) {
  const auto evidence = evidence_at(SE3(), 0.1);
  int near = 0, near_tracked = 0;
  const auto points = test_points(60, 1);
  for (std::size_t i = 0; i < 60; ++i) {
    near += points[i].norm() <= 4.0;
    near_tracked += i < 45 && points[i].norm() <= 4.0;
  }
  EXPECT_TRUE(evidence.stereo);
  EXPECT_EQ(evidence.near_tracked, near_tracked);
  EXPECT_EQ(evidence.near_tracked + evidence.near_new, near);
  EXPECT_GT(evidence.near_new, 0);
}

TEST(KeyframeInsertion, MakesLandmarksOfNearStereoPoints) {
  auto rig = std::make_shared<const Rig>(test_rig(0.1));
  Map map({0}, rig, std::make_shared<IdSource>());
  const auto points = test_points(80, 1);
  const SE3 pose(so3_exp({0, 0.1, 0}), Eigen::Vector3d(0.2, 0, 0));
  StereoLandmarkOptions options;
  options.min_landmarks = 10;
  EXPECT_NEAR(near_depth(*rig, options), 4, 1e-9);  // 40 baselines
  const KeyframeId id = insert_keyframe(map, test_frame(*rig, points, pose, 0), options);
  EXPECT_TRUE(is_consistent(map));
  const auto landmarks = map.landmarks_of(id);
  EXPECT_GT(landmarks.size(), 10u);
  EXPECT_LT(landmarks.size(), 80u);
  for (int i = 0; i < 80; ++i) {
    const LandmarkId landmark = map.at(id).frame[i].landmark;
    const auto& point = points[static_cast<std::size_t>(i)];
    EXPECT_EQ(landmark.valid(), (pose.inverse() * point).norm() <= 4) << i;
    if (landmark.valid()) {
      EXPECT_LT((map.at(landmark).position - point).norm(), 1e-4);
    }
  }
}

}  // namespace
}  // namespace rover
