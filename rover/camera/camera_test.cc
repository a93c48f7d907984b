#include "rover/camera/camera.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>
#include <opencv2/calib3d.hpp>

#include "rover/base/error.h"
#include "rover/geometry/random_geometry.h"

namespace rover {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Camera euroc_camera() {
  return Camera(CameraModel::kPinhole, 752, 480, {458.654, 457.296, 367.215, 248.375},
                {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
}

Camera tum_vi_camera() {
  return Camera(CameraModel::kFisheye, 512, 512, {190.97847, 190.97330, 254.93170, 256.89744},
                {0.0034823894, 0.00071503484, -0.0020532361, 0.00020293673});
}

// Lenses from barrel to pincushion, many of which fold back within the image.
Camera random_pinhole(Random& random) {
  const double f = random.uniform(250, 900);
  std::vector<double> d = {random.uniform(-0.5, 0.4), random.uniform(-0.2, 0.2),
                           random.uniform(-2e-3, 2e-3), random.uniform(-2e-3, 2e-3)};
  if (random.index(2) == 0) d.push_back(random.uniform(-0.05, 0.05));
  return Camera(
      CameraModel::kPinhole, 752, 480,
      {f, f * random.uniform(0.95, 1.05), random.uniform(330, 420), random.uniform(210, 270)}, d);
}

Camera random_fisheye(Random& random) {
  const double f = random.uniform(150, 400);
  return Camera(
      CameraModel::kFisheye, 640, 512,
      {f, f * random.uniform(0.95, 1.05), random.uniform(290, 350), random.uniform(230, 280)},
      {random.uniform(-0.1, 0.1), random.uniform(-0.05, 0.05), random.uniform(-0.02, 0.02),
       random.uniform(-0.005, 0.005)});
}

Camera random_camera(Random& random, int i) {
  return i % 2 == 0 ? random_pinhole(random) : random_fisheye(random);
}

Eigen::Vector3d random_point(Random& random, double max_angle) {
  const double angle = random.uniform(0, max_angle), turn = random.uniform(0, 7);
  const double distance = std::exp(random.uniform(-3, 4));
  return distance * Eigen::Vector3d(std::sin(angle) * std::cos(turn),
                                    std::sin(angle) * std::sin(turn), std::cos(angle));
}

Eigen::Vector2d project_by_opencv(const Camera& camera, const Eigen::Vector3d& point) {
  const auto& k = camera.intrinsics();
  const auto& d = camera.distortion();
  const cv::Matx33d matrix(k[0], 0, k[2], 0, k[1], k[3], 0, 0, 1);
  const std::vector<cv::Point3d> points = {{point.x(), point.y(), point.z()}};
  const cv::Vec3d zero(0, 0, 0);
  std::vector<cv::Point2d> pixels;
  if (camera.model() == CameraModel::kPinhole)
    cv::projectPoints(points, zero, zero, matrix, std::vector<double>(d.begin(), d.end()), pixels);
  else
    cv::fisheye::projectPoints(points, pixels, zero, zero, matrix,
                               std::vector<double>(d.begin(), d.begin() + 4));
  return {pixels[0].x, pixels[0].y};
}

TEST(Camera, ProjectsAsOpenCvDoes) {
  Random random(1);
  int seen = 0;
  for (int i = 0; i < 10000; ++i) {
    const Camera camera = random_camera(random, i);
    const Eigen::Vector3d point = random_point(random, 0.49 * std::numbers::pi);
    const auto pixel = camera.project(point);
    if (!pixel) continue;
    ++seen;
    const double scale = 1 + pixel->norm();
    EXPECT_LT((*pixel - project_by_opencv(camera, point)).norm(), 1e-12 * scale);
  }
  EXPECT_GT(seen, 7000);
}

TEST(Camera, UnprojectInvertsProjectWhereverThatIsValid) {
  Random random(2);
  int seen = 0;
  for (int i = 0; i < 20000; ++i) {
    const Camera camera = random_camera(random, i);
    const Eigen::Vector3d point = random_point(random, std::numbers::pi);
    const auto pixel = camera.project(point);
    if (!pixel || pixel->norm() > 1e5) continue;
    Matrix23d jacobian;
    camera.project(point.normalized(), &jacobian);
    const Eigen::Vector2d gains =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(jacobian * jacobian.transpose())
            .eigenvalues()
            .cwiseSqrt();
    if (gains.minCoeff() < 1) continue;  // px per rad: at the fold itself the inverse is singular
    ++seen;
    const auto ray = camera.unproject(*pixel);
    ASSERT_TRUE(ray) << i << ": " << point.transpose() << " seen at " << pixel->transpose();
    EXPECT_NEAR(ray->norm(), 1, 1e-14);
    EXPECT_LT((*ray - point.normalized()).norm(), 1e-8) << point.transpose();
  }
  EXPECT_GT(seen, 8000);
}

TEST(Camera, ProjectInvertsUnprojectWhereverThatIsValid) {
  Random random(3);
  int seen = 0;
  for (int i = 0; i < 20000; ++i) {
    const Camera camera = random_camera(random, i);
    const Eigen::Vector2d pixel(random.uniform(-200, camera.width() + 200),
                                random.uniform(-200, camera.height() + 200));
    const auto ray = camera.unproject(pixel);
    if (!ray) continue;
    ++seen;
    const auto back = camera.project(std::exp(random.uniform(-3, 4)) * *ray);
    ASSERT_TRUE(back) << pixel.transpose();
    EXPECT_LT((*back - pixel).norm(), 1e-6);
  }
  EXPECT_GT(seen, 12000);
}

TEST(Camera, RealCamerasUnprojectTheirWholeImage) {
  for (const Camera& camera : {euroc_camera(), tum_vi_camera()})
    for (int y = 0; y < camera.height(); y += 3)
      for (int x = 0; x < camera.width(); x += 3) {
        const auto ray = camera.unproject({x, y});
        ASSERT_TRUE(ray) << x << " " << y;
        const auto pixel = camera.project(*ray);
        ASSERT_TRUE(pixel);
        EXPECT_LT((*pixel - Eigen::Vector2d(x, y)).norm(), 1e-9);
      }
}

TEST(Camera, JacobianAgreesWithDifferences) {
  Random random(4);
  int seen = 0;
  for (int i = 0; i < 10000; ++i) {
    const Camera camera = random_camera(random, i);
    Eigen::Vector3d point = random_point(random, 0.6 * std::numbers::pi);
    // On the axis ahead; the one behind is a singular point of the fisheye.
    if (i % 5 == 0) point = {1e-9 * point.x(), 1e-9 * point.y(), std::abs(point.z())};
    if (i % 5 == 1) point = {0, 0, std::abs(point.z())};
    const double step = 1e-6 * point.norm();
    Matrix23d jacobian, numeric;
    const auto pixel = camera.project(point, &jacobian);
    if (!pixel || pixel->norm() > 1e4) continue;
    bool valid = true;
    for (int k = 0; k < 3; ++k) {
      const auto ahead = camera.project(point + step * Eigen::Vector3d::Unit(k));
      const auto behind = camera.project(point - step * Eigen::Vector3d::Unit(k));
      valid = valid && ahead && behind;
      if (valid) numeric.col(k) = (*ahead - *behind) / (2 * step);
    }
    if (!valid) continue;
    ++seen;
    EXPECT_LT((jacobian - numeric).norm(), 1e-5 * (1 + jacobian.norm())) << point.transpose();
  }
  EXPECT_GT(seen, 6000);
}

TEST(Camera, PinholeSeesNothingBehindOrBeyondTheFold) {
  const Camera camera = euroc_camera();
  EXPECT_FALSE(camera.project({0.1, 0.1, 0}));
  EXPECT_FALSE(camera.project({0.1, 0.1, -1}));
  EXPECT_FALSE(camera.project({kNan, 0, 1}));
  // r (1 - 0.3 r^2) grows up to r = sqrt(1 / 0.9).
  const Camera barrel(CameraModel::kPinhole, 752, 480, {450, 450, 375, 240}, {-0.3, 0, 0, 0});
  const double fold = std::sqrt(1 / 0.9);
  EXPECT_TRUE(barrel.project({0.999 * fold, 0, 1}));
  EXPECT_FALSE(barrel.project({1.001 * fold, 0, 1}));
  EXPECT_FALSE(barrel.unproject({375 + 450 * 0.71, 240}));  // the fold's image is at 0.703
}

TEST(Camera, PinholeFoldIsWhereTheRadiusStopsGrowing) {
  Random random(5);
  int folding = 0;
  for (int i = 0; i < 2000; ++i) {
    const std::vector<double> d = {random.uniform(-0.5, 0.1), random.uniform(-0.1, 0.1), 0, 0,
                                   random.uniform(-0.05, 0.02)};
    const Camera camera(CameraModel::kPinhole, 640, 480, {100, 100, 0, 0}, d);
    double last = -1, x = 0;
    for (; x < 5; x += 1e-3) {
      const double r2 = x * x, next = x * (1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4])));
      if (next <= last) break;
      last = next;
    }
    if (x >= 5) continue;
    ++folding;
    EXPECT_TRUE(camera.project({x - 3e-3, 0, 1}));
    EXPECT_FALSE(camera.project({x + 3e-3, 0, 1}));
    EXPECT_FALSE(camera.unproject({100 * last * 1.001 + 0.01, 0}));
  }
  EXPECT_GT(folding, 1000);
}

TEST(Camera, FisheyeSeesBehindItsPlaneUpToItsFold) {
  const Camera camera(CameraModel::kFisheye, 512, 512, {190, 190, 256, 256}, {0, 0, 0, 0});
  const auto seen = [&](double degrees) {
    const double a = degrees * std::numbers::pi / 180;
    return camera.project({std::sin(a), 0, std::cos(a)}).has_value();
  };
  EXPECT_TRUE(seen(0));
  EXPECT_TRUE(seen(95));
  EXPECT_TRUE(seen(179));
  EXPECT_FALSE(camera.project({0, 0, -1}));
  EXPECT_FALSE(camera.project({0, 0, 0}));
  const auto ray = camera.unproject({256 + 190 * 1.7, 256});
  ASSERT_TRUE(ray);
  EXPECT_LT(ray->z(), 0);
  EXPECT_FALSE(camera.unproject({256 + 190 * 3.2, 256}));
}

TEST(Camera, FisheyeFoldIsWhereTheAngleStopsGrowing) {
  // theta (1 - 0.1 theta^2) grows up to sqrt(1 / 0.3) = 1.8257 rad.
  const Camera camera(CameraModel::kFisheye, 512, 512, {190, 190, 256, 256}, {-0.1, 0, 0, 0});
  EXPECT_TRUE(camera.project({std::sin(1.825), 0, std::cos(1.825)}));
  EXPECT_FALSE(camera.project({std::sin(1.827), 0, std::cos(1.827)}));
  EXPECT_FALSE(camera.unproject({256 + 190 * 1.22, 256}));
}

TEST(Camera, RefusesPixelsThatAreNoNumbers) {
  for (const Camera& camera : {euroc_camera(), tum_vi_camera()}) {
    EXPECT_FALSE(camera.unproject({kNan, 1}));
    EXPECT_FALSE(camera.unproject({1, std::numeric_limits<double>::infinity()}));
    EXPECT_FALSE(camera.contains({kNan, 1}));
  }
}

TEST(Camera, ContainsKeepsABorder) {
  const Camera camera = euroc_camera();
  EXPECT_TRUE(camera.contains({0, 0}));
  EXPECT_TRUE(camera.contains({751, 479}));
  EXPECT_FALSE(camera.contains({751.1, 479}));
  EXPECT_FALSE(camera.contains({-0.1, 3}));
  EXPECT_FALSE(camera.contains({7, 100}, 8));
  EXPECT_TRUE(camera.contains({8, 471}, 8));
}

TEST(Camera, ConstructorRefusesNonsense) {
  const std::array<double, 4> good = {100, 100, 50, 50};
  const auto pinhole = CameraModel::kPinhole, fisheye = CameraModel::kFisheye;
  EXPECT_THROW(Camera(pinhole, 0, 480, good, {}), InputError);
  EXPECT_THROW(Camera(pinhole, 640, -1, good, {}), InputError);
  EXPECT_THROW(Camera(pinhole, 640, 480, {0, 100, 50, 50}, {}), InputError);
  EXPECT_THROW(Camera(pinhole, 640, 480, {100, -1, 50, 50}, {}), InputError);
  EXPECT_THROW(Camera(pinhole, 640, 480, {100, 100, kNan, 50}, {}), InputError);
  EXPECT_THROW(Camera(pinhole, 640, 480, good, {0, 0, 0}), InputError);
  EXPECT_THROW(Camera(pinhole, 640, 480, good, {0, 0, 0, kNan}), InputError);
  EXPECT_THROW(Camera(fisheye, 640, 480, good, {0, 0, 0, 0, 0}), InputError);
  EXPECT_NO_THROW(Camera(fisheye, 640, 480, good, {0, 0, 0, 0}));
  EXPECT_NO_THROW(Camera(pinhole, 640, 480, good, {0, 0, 0, 0, 0}));
  EXPECT_EQ(Camera(pinhole, 640, 480, good, {}).project({1, 0, 2})->x(), 100);
}

TEST(Rig, BaselineIsTheDistanceOfTheFirstTwoCameras) {
  Rig rig{{euroc_camera()}, {SE3(Eigen::Quaterniond::Identity(), {1, 2, 3})}};
  EXPECT_EQ(rig.size(), 1);
  EXPECT_EQ(rig.baseline(), 0);
  rig.cameras.push_back(euroc_camera());
  rig.body_from_camera.emplace_back(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 2.3, 3.4));
  EXPECT_NEAR(rig.baseline(), 0.5, 1e-12);
}

}  // namespace
}  // namespace rover
