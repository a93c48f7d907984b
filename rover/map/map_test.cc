#include "rover/map/map.h"

#include <thread>

#include <gtest/gtest.h>

#include "rover/geometry/random_geometry.h"
#include "rover/map/atlas.h"
#include "rover/map/shared_map.h"
#include "rover/map/test_map.h"

namespace rover {
namespace {

double worst_reprojection(const Map& map) {
  double worst = 0;
  for (const Landmark& landmark : map.landmarks()) {
    for (const auto& [keyframe, feature] : landmark.observations) {
      const Frame& frame = map.at(keyframe).frame;
      const SE3 world_from_camera = frame.world_from_body * map.rig().body_from_camera[0];
      const auto pixel =
          map.rig().cameras[0].project(world_from_camera.inverse() * landmark.position);
      worst = std::max(worst, (*pixel - frame[feature].pixel.cast<double>()).norm());
    }
  }
  return worst;
}

TEST(Map, KeepsBothSidesOfObservations) {
  Map map = test_map(5, 50);
  EXPECT_TRUE(is_consistent(map));
  EXPECT_EQ(map.keyframes().size(), 5u);
  EXPECT_EQ(map.at(LandmarkId{0}).observations.size(), 5u);
  EXPECT_EQ(map.covisible(KeyframeId{2}).size(), 4u);
  EXPECT_EQ(map.covisible(KeyframeId{2}).front().shared, 50);
  EXPECT_LT(worst_reprojection(map), 1e-3);
}

TEST(Map, StaysConsistentUnderRandomEdits) {
  Random random(9);
  for (int round = 0; round < 50; ++round) {
    Map map = test_map(6, 40, round % 2 ? 0.1 : 0, static_cast<std::uint64_t>(round));
    for (int step = 0; step < 60; ++step) {
      const LandmarkId a{random.index(40)}, b{random.index(40)};
      const KeyframeId k{random.index(6)};
      switch (random.index(6)) {
        case 0:
          map.forget(a, k);
          break;
        case 1:
          map.fuse(a, b);
          break;
        case 2:
          map.remove(a);
          break;
        case 3:
          if (k.value < 5) map.retire(k);
          break;
        case 4:
          map.observe(a, k, random.index(40));
          break;
        default:
          map.reject_stereo(a, k);
      }
    }
    EXPECT_TRUE(is_consistent(map));
    EXPECT_TRUE(map.find(KeyframeId{0}));  // the first keyframe is never culled
  }
}

TEST(Map, ObservesOnlyWhatIsFree) {
  Map map = test_map(2, 10);
  EXPECT_FALSE(map.observe({0}, {1}, 5));  // seen there already
  map.forget({0}, {1});
  EXPECT_FALSE(map.observe({0}, {1}, 5));  // the feature is landmark 5's
  EXPECT_TRUE(map.observe({0}, {1}, 0));
  EXPECT_FALSE(map.observe({99}, {1}, 0));  // no such landmark
  EXPECT_FALSE(map.observe({0}, {99}, 0));  // no such keyframe
}

// The place is where one landmark's patch lies: it says nothing of another one.
TEST(Map, FeaturesPartedFromTheirLandmarkAreAsDetected) {
  const auto refined = [] {
    Map map = test_map(3, 10);
    map.set_measurement({1}, 4, Eigen::Vector2f(7, 8), 0.06f);
    return map;
  };
  const auto expect_detected = [](const Frame& frame) {
    EXPECT_EQ(frame[4].pixel, frame.features->positions[4]);
    EXPECT_EQ(frame[4].sigma, frame.features->sigmas[4]);
    EXPECT_FALSE(frame[4].refined);
  };
  Map map = refined();
  map.forget({4}, {1});
  expect_detected(map.at(KeyframeId{1}).frame);
  map = refined();
  map.remove({4});
  expect_detected(map.at(KeyframeId{1}).frame);
  map = refined();
  map.forget({5}, {1});
  map.fuse({4}, {5});
  EXPECT_EQ(map.at(KeyframeId{1}).frame[4].landmark, LandmarkId{5});
  expect_detected(map.at(KeyframeId{1}).frame);
  map = refined();
  Frame again = map.at(KeyframeId{1}).frame;
  map.remove({4});
  expect_detected(map.at(map.add_keyframe(again)).frame);
}

TEST(Map, ALandmarkIsSeenExactlyWhereItsPatchIsFrom) {
  for (const bool has_image : {true, false}) {
    Map map = test_map(2, 10);
    const Rig rig = test_rig();
    Frame frame = test_frame(rig, {{0, 0, 4}}, SE3(), 9);
    if (has_image) frame.image = cv::Mat(480, 640, CV_8UC1, cv::Scalar(90));
    const KeyframeId id = map.add_keyframe(frame);
    map.add_landmark({0, 0, 4}, id, 0);
    EXPECT_EQ(map.at(id).frame[0].refined, has_image);
  }
}

TEST(Map, CulledKeyframesAreStoodInFor) {
  Map map = test_map(5, 30);
  const SE3 before = map.at(KeyframeId{3}).world_from_body();
  map.retire({3});
  map.retire({2});
  EXPECT_FALSE(map.find(KeyframeId{3}));
  EXPECT_LT(se3_minus(map.world_from_any({3}), before).norm(), 1e-9);
  EXPECT_TRUE(map.find(map.standing({3})));
  // It follows the one that stands in for it.
  const KeyframeId standing = map.standing({3});
  const SE3 moved(so3_exp({0.1, 0.2, 0.3}), Eigen::Vector3d(1, 2, 3));
  const SE3 relative = map.at(standing).world_from_body().inverse() * before;
  map.set_pose(standing, moved);
  EXPECT_LT(se3_minus(map.world_from_any({3}), moved * relative).norm(), 1e-9);
}

TEST(Map, AChangeOfGaugeLeavesReprojectionsAlone) {
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    Map map = test_map(4, 20);
    map.retire({2});
    const SE3 retired = map.world_from_any({2});
    Sim3 gauge;
    gauge.scale = random.uniform(0.1, 10);
    gauge.rotation = so3_exp({random.gaussian(), random.gaussian(), random.gaussian()});
    gauge.translation = {random.gaussian(), random.gaussian(), random.gaussian()};
    map.transform(gauge);
    EXPECT_LT(worst_reprojection(map), 2e-3);
    EXPECT_EQ(map.epoch(), 1);
    EXPECT_LT((map.world_from_any({2}).translation - gauge * retired.translation).norm(), 1e-9);
  }
}

// Inertial samples of a body at rest from one keyframe to the next, at 200 Hz.
std::shared_ptr<const Preintegration> still_motion(const Map& map, KeyframeId from, KeyframeId to) {
  std::vector<ImuSample> samples;
  const Timestamp end = map.at(to).frame.time;
  for (Timestamp t = map.at(from).frame.time; t <= end; t += kNanosecondsPerSecond / 200) {
    samples.push_back({t, Eigen::Vector3d::Zero(), {0, 0, kGravity}});
  }
  const ImuNoise noise = ImuNoise::of({1.7e-4, 1.9e-5, 2e-3, 3e-3, 200}, {});
  return std::make_shared<const Preintegration>(std::move(samples), ImuBias{}, noise);
}

TEST(Map, LinksKeyframesInTimeAndMergesMotions) {
  Map map = test_map(4, 20);
  for (const int k : {1, 2, 3}) map.set_motion({k}, still_motion(map, {k - 1}, {k}));
  EXPECT_FALSE(map.at(KeyframeId{0}).previous.valid());
  EXPECT_EQ(map.at(KeyframeId{0}).next, KeyframeId{1});
  EXPECT_EQ(map.at(KeyframeId{3}).previous, KeyframeId{2});
  map.retire({2});
  EXPECT_EQ(map.at(KeyframeId{1}).next, KeyframeId{3});
  const Keyframe& last = map.at(KeyframeId{3});
  EXPECT_EQ(last.previous, KeyframeId{1});
  ASSERT_TRUE(last.motion);
  EXPECT_EQ(last.motion->begin(), map.at(KeyframeId{1}).frame.time);
  EXPECT_EQ(last.motion->end(), last.frame.time);
  map.set_motion({1}, nullptr);
  map.retire({1});
  EXPECT_FALSE(map.at(KeyframeId{3}).motion);  // half of it is not known
  EXPECT_EQ(map.at(KeyframeId{3}).previous, KeyframeId{0});
}

// The extrinsics are metric whatever the map's scale is, so cameras move, and bodies with them.
TEST(Map, GaugeChangesKeepExtrinsicsAndTurnVelocities) {
  Random random(5);
  Rig rig = test_rig();
  rig.body_from_camera[0] = random_pose(random, 0.3);
  Map map({0}, std::make_shared<const Rig>(rig), std::make_shared<IdSource>());
  const auto points = test_points(20, 3);
  for (int k = 0; k < 2; ++k) {
    const SE3 camera(so3_exp({0, 0.02 * k, 0}), Eigen::Vector3d(0.2 * k, 0, 0));
    map.add_keyframe(test_frame(map.rig(), points, camera * rig.body_from_camera[0].inverse(), k));
  }
  for (int i = 0; i < 20; ++i) map.add_landmark(points[static_cast<std::size_t>(i)], {0}, i);
  for (int i = 0; i < 20; ++i) map.observe({i}, {1}, i);
  const Eigen::Vector3d velocity(1, -2, 0.5);
  map.set_velocity({1}, velocity, {});
  const SE3 relative =
      map.at(KeyframeId{0}).world_from_body().inverse() * map.at(KeyframeId{1}).world_from_body();
  const Sim3 gauge(3, so3_exp({0.4, -1, 0.2}), {5, 6, 7});
  map.transform(gauge);
  EXPECT_LT(worst_reprojection(map), 2e-3);
  EXPECT_DOUBLE_EQ(map.scale(), 3);
  EXPECT_LT((map.at(KeyframeId{1}).velocity - 3 * (gauge.rotation * velocity)).norm(), 1e-12);
  const SE3 moved =
      map.at(KeyframeId{0}).world_from_body().inverse() * map.at(KeyframeId{1}).world_from_body();
  EXPECT_LT(se3_minus(map.rescale_relative(relative, {1, rig.body_from_camera[0]}), moved).norm(),
            1e-9);
}

TEST(Map, MovingTheRigKeepsCamerasAndWhatHangsOnThem) {
  Map map = test_map(3, 20);
  const SE3 before = map.rig().body_from_camera[0];
  const MapUnits then = map.units();
  const SE3 asked = map.at(KeyframeId{1}).world_from_body();
  const SE3 relative = map.at(KeyframeId{0}).world_from_body().inverse() * asked;
  const SE3 camera = asked * before;
  map.retire({2});
  const SE3 retired_camera = map.world_from_any({2}) * before;
  Vector6d change;
  change << 0.02, -0.01, 0.03, 0.02, 0.01, -0.02;
  const int epoch = map.epoch();
  map.move_rig(se3_plus(before, change));
  const SE3& now = map.rig().body_from_camera[0];
  EXPECT_LT(se3_minus(now, se3_plus(before, change)).norm(), 1e-12);
  EXPECT_LT(se3_minus(*map.calibration().given, before).norm(), 1e-12);
  EXPECT_EQ(map.epoch(), epoch + 1);
  EXPECT_LT(se3_minus(map.at(KeyframeId{1}).world_from_body() * now, camera).norm(), 1e-9);
  EXPECT_LT(se3_minus(map.world_from_any({2}) * now, retired_camera).norm(), 1e-9);
  const SE3 moved =
      map.at(KeyframeId{0}).world_from_body().inverse() * map.at(KeyframeId{1}).world_from_body();
  EXPECT_LT(se3_minus(map.rescale_relative(relative, then), moved).norm(), 1e-9);
}

TEST(Atlas, BeginsMapsWithTheCalibrationFound) {
  Map map = test_map(1, 10);
  Atlas atlas(map.shared_rig());
  map.move_rig(se3_plus(map.rig().body_from_camera[0], Vector6d::Constant(0.01)));
  CalibrationStatus status = map.calibration();
  status.time_offset = 7;
  status.estimated = 5;
  atlas.set_calibration(map.shared_rig(), status);
  const auto next = atlas.begin_map()->view();
  EXPECT_EQ(next->shared_rig(), map.shared_rig());
  EXPECT_EQ(next->calibration().time_offset, 7);
  EXPECT_TRUE(next->calibration().given.has_value());
  EXPECT_EQ(next->calibration().estimated, 0);  // in this map
}

TEST(Map, StereoPartnersSupportALandmarkSeenOnce) {
  Map mono = test_map(1, 10);
  Map stereo = test_map(1, 10, 0.1);
  EXPECT_FALSE(mono.is_supported(mono.at(LandmarkId{0})));
  EXPECT_TRUE(stereo.is_supported(stereo.at(LandmarkId{0})));
  stereo.reject_stereo({0}, {0});
  EXPECT_FALSE(stereo.is_supported(stereo.at(LandmarkId{0})));
}

TEST(SharedMap, ViewsDoNotChange) {
  SharedMap shared(test_map(3, 20));
  const auto before = shared.view();
  const Eigen::Vector3d position = before->at(LandmarkId{4}).position;
  shared.commit([](Map& map) {
    map.set_position({4}, {9, 9, 9});
    map.remove({5});
  });
  EXPECT_EQ(before->at(LandmarkId{4}).position, position);
  EXPECT_TRUE(before->find(LandmarkId{5}));
  EXPECT_EQ(shared.view()->at(LandmarkId{4}).position, Eigen::Vector3d(9, 9, 9));
  EXPECT_FALSE(shared.view()->find(LandmarkId{5}));
}

TEST(SharedMap, ReadersAndWritersGoTogether) {
  SharedMap shared(test_map(3, 50));
  std::thread writer([&] {
    for (int i = 0; i < 300; ++i) {
      shared.commit([&](Map& map) {
        for (int k = 0; k < 50; ++k) map.set_position({k}, {0.0, 0.0, double(i)});
      });
    }
  });
  for (int i = 0; i < 300; ++i) {
    const auto view = shared.view();
    const Eigen::Vector3d first = view->at(LandmarkId{0}).position;
    const bool written = first.x() == 0;
    for (const Landmark& landmark : view->landmarks()) {
      if (written) {
        EXPECT_EQ(landmark.position, first);
      }
    }
  }
  writer.join();
  EXPECT_TRUE(is_consistent(*shared.view()));
}

}  // namespace
}  // namespace rover
