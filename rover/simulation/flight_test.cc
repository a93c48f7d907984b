#include "rover/simulation/flight.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/datasets/test_folder.h"
#include "rover/geometry/bearing.h"
#include "rover/geometry/random_geometry.h"

namespace rover {
namespace {

const FlightVolume kRoom = {{-3.2, -2, 0.5}, {3, 2.5, 2.3}, {}, false, 0};

// A corridor around a block, and one with a bend.
const FlightVolume kLoop = {
    {-1, -1, 0}, {13, 9, 3}, {{0, 0, 1.5}, {12, 0, 1.5}, {12, 8, 1.5}, {0, 8, 1.5}}, true, 0.6};
const FlightVolume kBend = {
    {-1, -1, 1}, {31, 21, 2}, {{0, 0, 1.5}, {30, 0, 1.5}, {30, 20, 1.5}}, false, 0.8};

constexpr FlightStyle kStyles[] = {FlightStyle::kSmooth, FlightStyle::kAggressive,
                                   FlightStyle::kShaking, FlightStyle::kHover};

double distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                           const Eigen::Vector3d& b) {
  const double share = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - share * (b - a)).norm();
}

double distance_to_path(const Eigen::Vector3d& p, const FlightVolume& volume) {
  const std::size_t count = volume.path.size();
  double distance = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + (volume.closed ? 0 : 1) < count; ++i) {
    distance =
        std::min(distance, distance_to_segment(p, volume.path[i], volume.path[(i + 1) % count]));
  }
  return distance;
}

struct Summary {
  double speed = 0, top_turn_rate = 0, top_acceleration = 0;
  Eigen::AlignedBox3d extent;
};

Summary summary_of(const SplineMotion& motion) {
  Summary summary;
  int count = 0;
  for (double t = 1.5; t <= motion.end(); t += 0.01, ++count) {
    const MotionState state = motion.at(t);
    summary.speed += state.velocity.norm();
    summary.top_turn_rate = std::max(summary.top_turn_rate, state.angular_velocity.norm());
    summary.top_acceleration = std::max(summary.top_acceleration, state.acceleration.norm());
    summary.extent.extend(state.world_from_body.translation);
  }
  summary.speed /= count;
  return summary;
}

TEST(Flight, StaysInTheVolume) {
  for (const FlightStyle style : kStyles) {
    for (const FlightVolume& volume : {kRoom, kLoop, kBend}) {
      for (std::uint64_t seed = 0; seed < 10; ++seed) {
        const SplineMotion motion = make_flight(volume, {40, style, 3, SE3(), seed});
        for (double t = 0; t <= motion.end(); t += 0.01) {
          const Eigen::Vector3d p = motion.pose_at(t).translation;
          ASSERT_GE((p - volume.min).minCoeff(), 0) << seed << " at " << t;
          ASSERT_GE((volume.max - p).minCoeff(), 0) << seed << " at " << t;
          if (volume.path.empty()) continue;
          ASSERT_LE(distance_to_path(p, volume), volume.path_radius) << seed << " at " << t;
        }
      }
    }
  }
}

TEST(Flight, StylesDifferAsStated) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const Summary smooth = summary_of(make_flight(kRoom, {60, FlightStyle::kSmooth, 3, {}, seed}));
    EXPECT_GT(smooth.speed, 0.5);
    EXPECT_LT(smooth.speed, 1.0);
    EXPECT_LT(smooth.top_turn_rate, 0.8);
    EXPECT_GT(smooth.extent.sizes().minCoeff(), 0.45 * (kRoom.max - kRoom.min).minCoeff());
    const Summary fast =
        summary_of(make_flight(kRoom, {60, FlightStyle::kAggressive, 3, {}, seed}));
    EXPECT_GT(fast.speed, 1.4);
    EXPECT_LT(fast.speed, 2.5);
    EXPECT_GT(fast.top_turn_rate, 1.2);
    EXPECT_LT(fast.top_turn_rate, 2.3);
    const Summary shaking =
        summary_of(make_flight(kRoom, {60, FlightStyle::kShaking, 3, {}, seed}));
    EXPECT_GT(shaking.top_turn_rate, 1);
    EXPECT_GT(shaking.top_acceleration, 5);
    EXPECT_LT(shaking.speed, 1.2);
  }
}

TEST(Flight, StartsAtRestAndIsMovedAboutAtOnce) {
  for (const FlightStyle style : kStyles) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      const SplineMotion motion = make_flight(kRoom, {20, style, 3, {}, seed});
      EXPECT_LT(motion.at(0).velocity.norm(), 1e-9);
      EXPECT_LT(motion.at(0).angular_velocity.norm(), 1e-9);
      double acceleration = 0, turn = 0;
      for (double t = 0; t < 4; t += 0.01) {
        acceleration += motion.at(t).acceleration.squaredNorm() / 400;
        turn += motion.at(t).angular_velocity.squaredNorm() / 400;
      }
      EXPECT_GT(std::sqrt(acceleration), 0.3) << seed;
      EXPECT_GT(std::sqrt(turn), 0.08) << seed;
    }
  }
}

TEST(Flight, HoversInTheMiddle) {
  const SplineMotion motion = make_flight(kRoom, {20, FlightStyle::kHover, 4, {}, 3});
  for (double t = 8.2; t <= 11.8; t += 0.05) {
    EXPECT_LT(motion.at(t).velocity.norm(), 1e-9);
    EXPECT_LT(motion.at(t).acceleration.norm(), 1e-6);
    EXPECT_LT(motion.at(t).angular_velocity.norm(), 1e-9);
  }
  EXPECT_GT(motion.at(6).velocity.norm(), 0.1);
  EXPECT_GT(motion.at(14).velocity.norm(), 0.1);
}

TEST(Flight, ClosedPathsComeBackToTheirStart) {
  for (const FlightStyle style : kStyles) {
    const double duration = lap_duration(kLoop, style);
    const SplineMotion motion = make_flight(kLoop, {duration, style, 3, {}, 1});
    const Eigen::Vector3d start = motion.pose_at(0).translation;
    double farthest = 0, nearest_again = 100;
    for (double t = 0; t <= motion.end(); t += 0.1) {
      const double away = (motion.pose_at(t).translation - start).norm();
      farthest = std::max(farthest, away);
      if (t > 0.7 * duration) nearest_again = std::min(nearest_again, away);
    }
    EXPECT_GT(farthest, 12);
    EXPECT_LT(nearest_again, 2 * kLoop.path_radius);
  }
}

TEST(Flight, OpenPathsAreFlownToTheirEnd) {
  const double duration = lap_duration(kBend, FlightStyle::kSmooth);
  EXPECT_NEAR(duration, 50 / 0.7, 2);
  const SplineMotion motion = make_flight(kBend, {duration, FlightStyle::kSmooth, 0, {}, 2});
  EXPECT_LT((motion.pose_at(motion.end()).translation - kBend.path.back()).norm(), 2);
}

TEST(Flight, SteersTheCamera) {
  Random random(4);
  const SE3 body_from_camera = random_pose(random);
  const FlightOptions options = {40, FlightStyle::kSmooth, 0, body_from_camera, 5};
  const SplineMotion motion = make_flight(kBend, options);
  double forward = 0;
  int count = 0;
  for (double t = 2; t <= 20; t += 0.1, ++count) {
    const MotionState state = motion.at(t);
    const Eigen::Quaterniond camera = state.world_from_body.rotation * body_from_camera.rotation;
    EXPECT_LT((camera * Eigen::Vector3d::UnitY()).z(), -0.9);  // the image stands upright
    forward += (camera * Eigen::Vector3d::UnitZ()).dot(state.velocity.normalized());
  }
  EXPECT_GT(forward / count, 0.8);
}

TEST(Flight, LooksInwardsFromTheWalls) {
  int inwards = 0, count = 0;
  const Eigen::Vector3d center = 0.5 * (kRoom.min + kRoom.max);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const SplineMotion motion = make_flight(kRoom, {60, FlightStyle::kSmooth, 0, {}, seed});
    for (double t = 2; t <= 60; t += 0.5) {
      const SE3 pose = motion.pose_at(t);
      const Eigen::Vector3d outwards = pose.translation - center;
      if (outwards.head<2>().norm() < 1.5) continue;
      const Eigen::Vector3d view = pose.rotation * Eigen::Vector3d::UnitZ();
      inwards += angle_between(view, outwards) > M_PI / 4;
      ++count;
    }
  }
  EXPECT_GT(count, 300);
  EXPECT_GT(inwards, 0.75 * count);
}

TEST(Flight, SeedsDecide) {
  const auto fly = [](std::uint64_t seed) {
    return make_flight(kRoom, {10, FlightStyle::kShaking, 0, {}, seed}).pose_at(7).matrix();
  };
  EXPECT_EQ(fly(1), fly(1));
  EXPECT_GT((fly(1) - fly(2)).norm(), 0.1);
}

TEST(Flight, RefusesWhatCannotBeFlown) {
  const auto message = [](FlightVolume volume, FlightOptions options) {
    return input_error_of([&] { make_flight(volume, options); });
  };
  using ::testing::HasSubstr;
  FlightVolume flat = kRoom, narrow = kLoop, outside = kLoop, point = kLoop;
  flat.max.z() = flat.min.z();
  EXPECT_THAT(message(flat, {}), HasSubstr("box"));
  narrow.path_radius = 0;
  EXPECT_THAT(message(narrow, {}), HasSubstr("narrower"));
  outside.path[1].x() = 50;
  EXPECT_THAT(message(outside, {}), HasSubstr("leaves"));
  point.path = {point.path[0], point.path[0]};
  EXPECT_THAT(message(point, {}), HasSubstr("shorter"));
  FlightOptions options;
  options.duration = 0;
  EXPECT_THAT(message(kRoom, options), HasSubstr("duration"));
  options.duration = 5;
  options.style = FlightStyle::kHover;
  EXPECT_THAT(message(kRoom, options), HasSubstr("standing still"));
  EXPECT_THAT(input_error_of([] { parse_flight_style("wild"); }), HasSubstr("wild"));
  EXPECT_EQ(parse_flight_style("shaking"), FlightStyle::kShaking);
}

}  // namespace
}  // namespace rover
