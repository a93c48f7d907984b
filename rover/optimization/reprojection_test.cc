#include "rover/optimization/reprojection.h"

#include <gtest/gtest.h>

#include "rover/optimization/robust_kernel.h"
#include "rover/optimization/simulated_bundle.h"

namespace rover {
namespace {

struct Case {
  SE3 world_from_body;
  Eigen::Vector3d point;
  Eigen::Vector2d pixel;
  double sigma;
};

// A random pose and a point somewhere in front of its first camera.
Case random_case(const Rig& rig, Random& random) {
  const SE3 pose = random_pose(random, 3);
  const double depth = random.uniform(0.5, 20);
  const Eigen::Vector3d in_camera(depth * random.uniform(-0.5, 0.5),
                                  depth * random.uniform(-0.4, 0.4), depth);
  const Eigen::Vector2d pixel(random.uniform(0, 500), random.uniform(0, 400));
  return {pose, pose * (rig.body_from_camera[0] * in_camera), pixel, random.uniform(0.3, 3)};
}

class ReprojectionTest : public testing::TestWithParam<CameraModel> {
 protected:
  Rig rig() const {
    return simulated_rig(
        GetParam() == CameraModel::kPinhole ? simulated_pinhole() : simulated_fisheye(), 2);
  }
};

TEST_P(ReprojectionTest, JacobiansAgreeWithNumericOnes) {
  const Rig cameras = rig();
  const Reprojector reprojector(cameras);
  Random random(1);
  int compared = 0;
  for (int i = 0; i < 3000; ++i) {
    const Case c = random_case(cameras, random);
    const int camera = i % 3 - 1;
    Eigen::Vector2d residual;
    Matrix26d by_pose;
    Matrix23d by_point;
    if (!reprojector.evaluate(camera, c.world_from_body, c.point, c.pixel, c.sigma, residual,
                              &by_pose, &by_point))
      continue;
    const auto at = [&](const SE3& pose, const Eigen::Vector3d& point) {
      Eigen::Vector2d r(1e9, 1e9);
      EXPECT_TRUE(reprojector.evaluate(camera, pose, point, c.pixel, c.sigma, r, nullptr, nullptr));
      return r;
    };
    const double h = 1e-6;
    Matrix26d numeric_pose;
    for (int k = 0; k < 6; ++k) {
      const Vector6d d = h * Vector6d::Unit(k);
      numeric_pose.col(k) = (at(se3_plus(c.world_from_body, d), c.point) -
                             at(se3_plus(c.world_from_body, -d), c.point)) /
                            (2 * h);
    }
    Matrix23d numeric_point;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d d = h * Eigen::Vector3d::Unit(k);
      numeric_point.col(k) =
          (at(c.world_from_body, c.point + d) - at(c.world_from_body, c.point - d)) / (2 * h);
    }
    EXPECT_LT((by_pose - numeric_pose).norm(), 1e-6 * (1 + by_pose.norm()));
    EXPECT_LT((by_point - numeric_point).norm(), 1e-6 * (1 + by_point.norm()));
    ++compared;
  }
  EXPECT_GT(compared, 2500);
}

// In whatever order a point's observations come, and for one that no camera sees.
TEST_P(ReprojectionTest, ObservationsOfOnePointShareWhatTheyNeed) {
  const Rig cameras = rig();
  const Reprojector reprojector(cameras);
  Random random(5);
  int unseen = 0;
  for (int i = 0; i < 1000; ++i) {
    const Case c = random_case(cameras, random);
    Eigen::Vector3d x = BodyFrame(c.world_from_body).from_world(c.point);
    if (i % 10 == 0) x = -x;
    ObservedPoint point(reprojector, x, true);
    for (int k = 0; k < 6; ++k) {
      const int camera = (i + k * (i % 2 + 1)) % 3 - 1;
      Eigen::Vector2d shared(0, 0), alone(0, 0);
      Matrix23d by_shared = Matrix23d::Zero(), by_alone = Matrix23d::Zero();
      const bool seen = point.evaluate(camera, c.pixel, c.sigma, shared, &by_shared);
      EXPECT_EQ(seen, reprojector.evaluate(camera, x, c.pixel, c.sigma, alone, &by_alone));
      EXPECT_EQ(shared, alone);
      EXPECT_EQ(by_shared, by_alone);
      EXPECT_EQ(point.chi2(camera, c.pixel, c.sigma),
                reprojector.chi2(camera, x, c.pixel, c.sigma));
      unseen += !seen;
    }
  }
  if (GetParam() == CameraModel::kPinhole) {  // a fisheye sees behind
    EXPECT_GT(unseen, 0);
  }
}

TEST_P(ReprojectionTest, BlocksOfTheNormalEquationsAreProductsOfTheJacobians) {
  const Rig cameras = rig();
  const Reprojector reprojector(cameras);
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    const Case c = random_case(cameras, random);
    const double weight = random.uniform(0.1, 1);
    const BodyFrame frame(c.world_from_body);
    const Eigen::Vector3d x = frame.from_world(c.point);
    Eigen::Vector2d residual;
    Matrix23d by_body_point, by_point;
    Matrix26d by_pose;
    ASSERT_TRUE(reprojector.evaluate(0, x, c.pixel, c.sigma, residual, &by_body_point));
    ASSERT_TRUE(reprojector.evaluate(0, c.world_from_body, c.point, c.pixel, c.sigma, residual,
                                     &by_pose, &by_point));
    PointInformation information;
    information.add(by_body_point, residual, weight);
    Matrix6d hessian = Matrix6d::Zero();
    Vector6d gradient = Vector6d::Zero();
    information.add_to_pose(x, hessian, gradient);
    EXPECT_TRUE(hessian.isApprox(weight * by_pose.transpose() * by_pose, 1e-10));
    EXPECT_TRUE(gradient.isApprox(weight * by_pose.transpose() * residual, 1e-9));
    EXPECT_TRUE(information.cross(x, frame.rotation)
                    .isApprox(weight * by_pose.transpose() * by_point, 1e-10));
  }
}

TEST_P(ReprojectionTest, VanishesWhereThePointIsSeen) {
  const Rig cameras = rig();
  const Reprojector reprojector(cameras);
  const SE3 pose(so3_exp({0.1, 0.2, -0.3}), {1, 2, 3});
  const Eigen::Vector3d in_camera(0.2, -0.1, 2);
  const Eigen::Vector3d in_body = cameras.body_from_camera[1] * in_camera;
  const Eigen::Vector2d pixel = *cameras.cameras[1].project(in_camera);
  EXPECT_NEAR(reprojector.chi2(1, in_body, pixel, 0.5), 0, 1e-18);
  EXPECT_NEAR(reprojector.chi2(1, in_body, pixel + Eigen::Vector2d(1, 0), 0.5), 4, 1e-9);
  EXPECT_LT((BodyFrame(pose).from_world(pose * in_body) - in_body).norm(), 1e-14);
}

// The error that both places share is not the disparity's.
TEST_P(ReprojectionTest, DisparitiesAreDifferencesOfPlaces) {
  const Rig cameras = rig();
  const Reprojector reprojector(cameras);
  const Eigen::Vector3d in_body = cameras.body_from_camera[1] * Eigen::Vector3d(0.2, -0.1, 2);
  const auto place = [&](std::size_t camera) {
    return *cameras.cameras[camera].project(cameras.body_from_camera[camera].inverse() * in_body);
  };
  const Eigen::Vector2d disparity = place(1) - place(0);
  EXPECT_NEAR(reprojector.chi2(kDisparity, in_body, disparity, 0.5), 0, 1e-18);
  Eigen::Vector2d residual, left, right;
  const Eigen::Vector2d seen_left(210, 190), seen_right(150, 185);
  ASSERT_TRUE(reprojector.evaluate(0, in_body, seen_left, 0.5, left, nullptr));
  ASSERT_TRUE(reprojector.evaluate(1, in_body, seen_right, 0.5, right, nullptr));
  ASSERT_TRUE(
      reprojector.evaluate(kDisparity, in_body, seen_right - seen_left, 0.5, residual, nullptr));
  EXPECT_LT((residual - (right - left)).norm(), 1e-10);
}

INSTANTIATE_TEST_SUITE_P(Models, ReprojectionTest,
                         testing::Values(CameraModel::kPinhole, CameraModel::kFisheye));

TEST(Reprojection, ReportsPointsBehindThePinholeCamera) {
  const Rig rig = simulated_rig(simulated_pinhole(), 1);
  const Reprojector reprojector(rig);
  Eigen::Vector2d residual(7, 7);
  EXPECT_FALSE(reprojector.evaluate(0, {0, 0, -2}, {100, 100}, 1, residual, nullptr));
  EXPECT_EQ(residual, Eigen::Vector2d(7, 7));
  EXPECT_EQ(reprojector.chi2(0, {0, 0, -2}, {100, 100}, 1), kUnseenChi2);
}

TEST(Reprojection, ADisparityIsSeenWhereBothCamerasSeeThePoint) {
  Rig rig = simulated_rig(simulated_pinhole(), 2);
  rig.body_from_camera[1].translation.z() = 3;
  const Reprojector reprojector(rig);
  Eigen::Vector2d residual(7, 7);
  Matrix23d jacobian = Matrix23d::Constant(7);
  EXPECT_FALSE(reprojector.evaluate(kDisparity, {0, 0, 2}, {9, 1}, 1, residual, &jacobian));
  EXPECT_EQ(residual, Eigen::Vector2d(7, 7));
  EXPECT_EQ(jacobian, Matrix23d::Constant(7));
  EXPECT_EQ(reprojector.chi2(kDisparity, {0, 0, 2}, {9, 1}, 1), kUnseenChi2);
  EXPECT_LT(reprojector.chi2(kDisparity, {0, 0, 5}, {9, 1}, 1), kUnseenChi2);
}

TEST(HuberKernel, IsQuadraticThenLinearThenConstant) {
  const HuberKernel kernel{2};
  EXPECT_EQ(kernel.rho(3), 3);
  EXPECT_EQ(kernel.weight(3), 1);
  EXPECT_DOUBLE_EQ(kernel.rho(100), 2 * 2 * 10 - 4);
  EXPECT_DOUBLE_EQ(kernel.weight(100), 0.2);
  EXPECT_EQ(kernel.rho(1e30), kernel.rho(kUnseenChi2));
  EXPECT_EQ(kernel.weight(1e30), 0);
  for (const double s : {1.0, 3.9, 4.1, 50.0}) {
    const double h = 1e-6;
    EXPECT_NEAR((kernel.rho(s + h) - kernel.rho(s - h)) / (2 * h), kernel.weight(s), 1e-6);
  }
}

}  // namespace
}  // namespace rover
