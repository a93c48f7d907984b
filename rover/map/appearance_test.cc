#include "rover/map/appearance.h"

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "rover/map/test_map.h"
#include "rover/matching/test_images.h"

namespace rover {
namespace {

const Camera kCamera(CameraModel::kPinhole, 200, 160, {250, 250, 100, 80}, {0, 0, 0, 0});
const Eigen::Vector3d kPoint(0.05, -0.03, 2);  // m, in the reference camera's frame

// A textured wall through kPoint, seen by a camera at any pose.
class Wall {
 public:
  Wall(std::uint64_t seed, const Eigen::Vector2d& slant) : texture_(seed, 6, 25, 30) {
    const Eigen::Vector3d ray = kPoint.normalized();
    const Eigen::Vector3d down = ray.cross(Eigen::Vector3d::UnitX()).normalized();
    const Eigen::Vector3d right = down.cross(ray);
    normal_ = (ray + slant.x() * right + slant.y() * down).normalized();
    along_ = normal_.cross(Eigen::Vector3d::UnitY()).normalized();
    up_ = normal_.cross(along_);
  }

  Eigen::Vector3d hit(const SE3& reference_from_camera, const Eigen::Vector2d& pixel) const {
    const Eigen::Vector3d from = reference_from_camera.translation;
    const Eigen::Vector3d ray = reference_from_camera.rotation * kCamera.unproject(pixel).value();
    return from + ray * (normal_.dot(kPoint - from) / normal_.dot(ray));
  }

  cv::Mat seen_from(const SE3& reference_from_camera, std::uint64_t seed) const {
    constexpr double kTexels = 125;  // per m: one pixel at 2 m
    return texture_.render(
        {200, 160},
        [&](const Eigen::Vector2d& pixel) {
          const Eigen::Vector3d at = hit(reference_from_camera, pixel) - kPoint;
          return Eigen::Vector2d(kTexels * along_.dot(at), kTexels * up_.dot(at));
        },
        1, 0, 2, seed);
  }

 private:
  SmoothTexture texture_;
  Eigen::Vector3d normal_, along_, up_;
};

SE3 view(double x, double y, double z, double turn) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY())), {x, y, z}};
}

// The world is the reference camera's frame.
Landmark landmark_on(const cv::Mat& wall) {
  Frame frame = test_frame({{kCamera}, {SE3()}}, {kPoint}, SE3(), 1);
  frame.image = wall;
  Landmark landmark;
  landmark.position = kPoint;
  landmark.appearance = make_appearance(kCamera, frame, 0);
  return landmark;
}

Observation observation_at(const Eigen::Vector2f& pixel) { return {{}, pixel, 1, false, false}; }

TEST(SlantedWarp, IsThatOfThePlane) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    const Eigen::Vector2d slant(random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5));
    const Wall wall(seed, slant);
    const Landmark landmark = landmark_on({});  // a warp needs no patch
    const SE3 there = view(random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4),
                           random.uniform(-0.5, 0.5), random.uniform(-0.2, 0.2));
    const auto warp = slanted_warp(landmark, kCamera, there.inverse());
    const Eigen::Vector2d center = kCamera.project(kPoint).value();
    const auto moved = [&](const Eigen::Vector2d& offset) {
      return kCamera.project(there.inverse() * wall.hit(SE3(), center + offset)).value();
    };
    Eigen::Matrix2d expected;
    expected << moved({1, 0}) - moved({0, 0}), moved({0, 1}) - moved({0, 0});
    ASSERT_TRUE(warp);
    EXPECT_LT((warp->at(slant.cast<float>()).cast<double>() - expected).norm(), 0.01) << seed;
  }
}

TEST(RefineObservation, StartsWhereTheLandmarkIsExpected) {
  const SE3 there = view(0.1, 0, 0, 0.05);
  int expected = 0, detected = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const Wall wall(seed, {0, 0});
    Landmark landmark = landmark_on(wall.seen_from(SE3(), 1));
    const cv::Mat image = wall.seen_from(there, 2);
    const Eigen::Vector2d truth = kCamera.project(there.inverse() * kPoint).value();
    const auto finds = [&](const Eigen::Vector2d& detection) {
      Observation observation = observation_at(detection.cast<float>());
      return refine_observation(landmark, kCamera, there.inverse(), image, {}, observation) &&
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
      const SE3 there = view(x, -0.7 * x, 0, -0.4 * x);
      const Eigen::Vector2f place = kCamera.project(there.inverse() * kPoint).value().cast<float>();
      const auto learned = learn_slant(landmark, kCamera, there.inverse(), wall.seen_from(there, 3),
                                       {}, observation_at(place + Eigen::Vector2f(0.5f, 0.5f)));
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
  const cv::Mat image = wall.seen_from(SE3(), 2);
  const Observation seen = observation_at(kCamera.project(kPoint).value().cast<float>());
  EXPECT_FALSE(learn_slant(landmark, kCamera, SE3(), image, {}, seen)) << "the reference itself";
  const SE3 there = view(0.3, 0, 0, -0.1);
  const Observation off = observation_at({30, 30});
  EXPECT_FALSE(learn_slant(landmark, kCamera, there.inverse(), wall.seen_from(there, 2), {}, off))
      << "not refined, and far from where it is expected";
  EXPECT_FALSE(learn_slant(landmark, kCamera, there.inverse(), cv::Mat(), {}, seen));
  auto bare = std::make_shared<Appearance>(*landmark.appearance);
  bare->has_patch = false;
  landmark.appearance = bare;
  EXPECT_FALSE(learn_slant(landmark, kCamera, there.inverse(), image, {}, seen));
}

}  // namespace
}  // namespace rover
