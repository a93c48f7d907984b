#include "rover/simulation/renderer.h"

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "rover/base/error.h"
#include "rover/simulation/rigs.h"
#include "rover/simulation/test_scene.h"

namespace rover {
namespace {

// Mean and variance of the light around a pixel.
struct Spot {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Vector2d variance = Eigen::Vector2d::Zero();
  double weight = 0;
};

Spot spot_at(const cv::Mat& image, const Eigen::Vector2d& guess, int reach) {
  Spot spot;
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();
  const int cx = static_cast<int>(std::lround(guess.x()));
  const int cy = static_cast<int>(std::lround(guess.y()));
  for (int y = cy - reach; y <= cy + reach; ++y) {
    for (int x = cx - reach; x <= cx + reach; ++x) {
      // Paint is never quite black.
      const double light = image.at<float>(y, x);
      const Eigen::Vector2d at(x, y);
      spot.weight += light;
      spot.mean += light * at;
      squares += light * at.cwiseProduct(at);
    }
  }
  spot.mean /= spot.weight;
  spot.variance = squares / spot.weight - spot.mean.cwiseProduct(spot.mean);
  return spot;
}

cv::Mat camera_matrix(const Camera& camera) {
  const auto& k = camera.intrinsics();
  return (cv::Mat_<double>(3, 3) << k[0], 0, k[2], 0, k[1], k[3], 0, 0, 1);
}

// By OpenCV alone; the point is in the camera frame, in front of it.
Eigen::Vector2d project_by_opencv(const Camera& camera, const Eigen::Vector3d& p) {
  const std::vector<cv::Point3d> points = {{p.x(), p.y(), p.z()}};
  std::vector<cv::Point2d> pixels;
  const auto& d = camera.distortion();
  const cv::Vec3d zero(0, 0, 0);
  if (camera.model() == CameraModel::kFisheye) {
    cv::fisheye::projectPoints(points, pixels, zero, zero, camera_matrix(camera),
                               cv::Vec4d(d[0], d[1], d[2], d[3]));
  } else {
    cv::projectPoints(points, zero, zero, camera_matrix(camera),
                      std::vector<double>(d.begin(), d.end()), pixels);
  }
  return {pixels[0].x, pixels[0].y};
}

Shot resting_shot(const SE3& world_from_camera) {
  Shot shot;
  shot.world_from_camera = {world_from_camera, world_from_camera};
  shot.lamps.assign(kLampGroups, 1.0F);
  return shot;
}

struct Agreement {
  int dots = 0;
  double worst = 0;
};

// Renders the dots with a turned and moved camera and looks for each where OpenCV says it is.
Agreement compare_with_opencv(const DotScene& scene, const Camera& camera, const SE3& pose) {
  RenderOptions options;
  options.samples = 16;
  const cv::Mat image = Renderer(scene.scene, {camera}, options).render(0, resting_shot(pose));
  Agreement agreement;
  constexpr double kWidest = 1.25;  // rad off the optical axis
  for (std::size_t i = 0; i < scene.dots.size(); ++i) {
    const Eigen::Vector3d p = pose.inverse() * scene.dots[i];
    const Eigen::Vector3d ray = (scene.dots[i] - pose.translation).normalized();
    const double limit = camera.model() == CameraModel::kFisheye ? kWidest : 0.8;
    if (std::atan2(p.head<2>().norm(), p.z()) > limit) continue;
    if (std::abs(ray.dot(scene.normals[i])) < 0.35) continue;
    const Eigen::Vector2d expected = project_by_opencv(camera, p);
    if (!camera.contains(expected, 12)) continue;
    const int reach = camera.model() == CameraModel::kFisheye ? 6 : 9;
    agreement.worst =
        std::max(agreement.worst, (spot_at(image, expected, reach).mean - expected).norm());
    ++agreement.dots;
  }
  return agreement;
}

TEST(Renderer, PutsPointsWhereOpenCvProjectsThem) {
  const DotScene scene = make_dot_scene(0.4);
  const SE3 body(so3_exp({0.05, -0.12, 0.08}), {0.1, -0.15, -0.2});
  for (const char* name : {"euroc", "tumvi"}) {
    const Rig rig = make_rig(name);
    for (int i = 0; i < rig.size(); ++i) {
      // The world is laid out along camera 0.
      const SE3 pose = body * rig.body_from_camera[0].inverse() * rig.body_from_camera[i];
      const Agreement agreement = compare_with_opencv(scene, rig.cameras[i], pose);
      EXPECT_GE(agreement.dots, 40) << name << " camera " << i;
      EXPECT_LT(agreement.worst, 0.1) << name << " camera " << i;
    }
  }
}

class Blur : public ::testing::Test {
 protected:
  Blur() : scene_(make_dot_scene(0.6)), camera_(make_rig("mono").cameras[0]) {}

  cv::Mat render(double exposure, double readout, double speed) const {
    RenderOptions options;
    options.samples = 32;
    options.exposure = exposure;
    options.readout = readout;
    const StraightMotion motion(1, {speed, 0, 0});
    return Renderer(scene_.scene, {camera_}, options)
        .render(0, take_shot(motion, SE3(), 0.5, options));
  }
  // Dots on the far side that are well inside the image.
  std::vector<Eigen::Vector2d> dots() const {
    std::vector<Eigen::Vector2d> pixels;
    for (const Eigen::Vector3d& dot : scene_.dots) {
      const auto pixel = camera_.project(dot);
      if (dot.z() > 2.4 && pixel && camera_.contains(*pixel, 30)) pixels.push_back(*pixel);
    }
    return pixels;
  }

  DotScene scene_;
  Camera camera_;
};

TEST_F(Blur, SpreadsOverThePathOfTheExposure) {
  constexpr double kExposure = 0.02, kSpeed = 1.5;
  const cv::Mat sharp = render(1e-5, 0, kSpeed), blurred = render(kExposure, 0, kSpeed);
  const double path = camera_.focal_length() * kSpeed * kExposure / 2.5;  // px
  const auto pixels = dots();
  ASSERT_GE(pixels.size(), 15U);
  for (const Eigen::Vector2d& pixel : pixels) {
    const Spot a = spot_at(sharp, pixel, 14), b = spot_at(blurred, pixel, 14);
    EXPECT_NEAR(b.variance.x() - a.variance.x(), path * path / 12, 0.1 * path * path / 12);
    EXPECT_NEAR(b.variance.y(), a.variance.y(), 0.15);
    EXPECT_NEAR(b.mean.x(), a.mean.x(), 0.08);  // the stamp is mid-exposure
  }
}

TEST_F(Blur, RollingShutterShiftsRowsByTheirTime) {
  constexpr double kReadout = 0.03, kSpeed = 1;
  const cv::Mat global = render(1e-4, 0, kSpeed), rolling = render(1e-4, kReadout, kSpeed);
  double largest = 0;
  for (const Eigen::Vector2d& pixel : dots()) {
    const Spot a = spot_at(global, pixel, 12), b = spot_at(rolling, pixel, 12);
    const double time = (pixel.y() / (camera_.height() - 1) - 0.5) * kReadout;
    const double expected = -camera_.focal_length() * kSpeed * time / 2.5;
    EXPECT_NEAR(b.mean.x() - a.mean.x(), expected, 0.08 + 0.05 * std::abs(expected));
    largest = std::max(largest, std::abs(expected));
  }
  EXPECT_GT(largest, 1.5);  // or the test would show nothing
}

TEST(Renderer, IsBlackWhereTheCameraHasNoRay) {
  const DotScene scene = make_dot_scene(0.6);
  const Camera narrow(CameraModel::kFisheye, 512, 512, {190, 190, 255, 255}, {0, -0.1, 0, 0});
  ASSERT_FALSE(narrow.unproject({1, 1}).has_value());
  const cv::Mat image = Renderer(scene.scene, {narrow}, {}).render(0, resting_shot(SE3()));
  EXPECT_EQ(image.at<float>(1, 1), 0);
}

TEST(Renderer, ShowsMovingObjectsWhereTheyAre) {
  DotScene made = make_dot_scene(0.6);
  made.scene.textures.emplace_back(cv::Mat(50, 50, CV_8U, cv::Scalar(200)), 0.01);
  MovingObject object;
  object.half_size = {0.2, 0.2, 0.2};
  object.centre = {0, 0, 1.5};
  object.radius = 0.5;
  object.angular_speed = 1;
  object.textures.assign(6, static_cast<int>(made.scene.textures.size()) - 1);
  made.scene.objects = {object};
  Lamp lamp;
  lamp.position = {0, 0, 0.1F};
  made.scene.lamps = {lamp};
  made.scene.ambient = 1;
  const Camera camera = make_rig("mono").cameras[0];
  const Renderer renderer(made.scene, {camera}, {});
  for (const double seconds : {0.0, 1.0, 3.0}) {
    Shot shot = resting_shot(SE3());
    shot.seconds = seconds;
    const Eigen::Vector3d at = object.world_from_object(seconds).translation;
    const Eigen::Vector2d pixel = *camera.project(at);
    const cv::Mat image = renderer.render(0, shot);
    EXPECT_GT(image.at<float>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x())), 0.3F);
    const Eigen::Vector2d mirrored = *camera.project({-at.x(), -at.y(), at.z()});
    EXPECT_LT(image.at<float>(static_cast<int>(mirrored.y()), static_cast<int>(mirrored.x())),
              0.2F);
  }
}

TEST(Renderer, RefusesOptionsThatMakeNoSense) {
  RenderOptions options;
  options.samples = 0;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.exposure = 0;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.readout = 1;
  EXPECT_THROW(options.check(), InputError);
}

}  // namespace
}  // namespace rover
