#include "rover/camera/stereo_rectification.h"

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/geometry/random_geometry.h"

namespace rover {
namespace {

Camera make_camera(bool fisheye) {
  if (fisheye)
    return Camera(CameraModel::kFisheye, 512, 512, {190.9, 190.9, 254.9, 256.9},
                  {0.0034823894, 0.00071503484, -0.0020532361, 0.00020293673});
  return Camera(CameraModel::kPinhole, 752, 480, {458.654, 457.296, 367.215, 248.375},
                {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
}

Rig make_rig(Random& random, bool fisheye) {
  const SE3 body_from_left = random_pose(random);
  const SE3 left_from_right(random_rotation(random, 0.1),
                            {0.11, 0.01 * random.gaussian(), 0.01 * random.gaussian()});
  return {{make_camera(fisheye), make_camera(fisheye)},
          {body_from_left, body_from_left * left_from_right}};
}

TEST(StereoRectification, RowsAgreeAndDisparityIsDepth) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const Rig rig = make_rig(random, i % 2);
    const StereoRectification rectified = rectify_stereo(rig);
    const SE3 right_from_left = rig.body_from_camera[1].inverse() * rig.body_from_camera[0];
    for (int k = 0; k < 200; ++k) {
      const Eigen::Vector3d point(random.gaussian(), random.gaussian(), random.uniform(2, 20));
      const auto left = rectified.project(0, point.normalized());
      const auto right = rectified.project(1, (right_from_left * point).normalized());
      if (!left || !right) continue;
      const double depth = (rectified.rectified_from_camera[0] * point).z();
      EXPECT_NEAR(left->y(), right->y(), 1e-9);
      EXPECT_NEAR(left->x() - right->x(), rectified.focal * rectified.baseline / depth, 1e-9);
    }
  }
}

TEST(StereoRectification, MapsLeadBackToTheRawImage) {
  Random random(2);
  for (int i = 0; i < 4; ++i) {
    const Rig rig = make_rig(random, i % 2);
    const StereoRectification rectified = rectify_stereo(rig, i < 2 ? 1 : 0.6);
    int seen = 0;
    for (int camera = 0; camera < 2; ++camera)
      for (int v = 0; v < rectified.height; v += 7)
        for (int u = 0; u < rectified.width; u += 7) {
          const Eigen::Vector2d raw(rectified.map_x[camera].at<float>(v, u),
                                    rectified.map_y[camera].at<float>(v, u));
          if (!rig.cameras[camera].contains(raw)) continue;
          const auto back = rectified.project(camera, *rig.cameras[camera].unproject(raw));
          ASSERT_TRUE(back);
          EXPECT_LT((*back - Eigen::Vector2d(u, v)).norm(), 0.01);
          ++seen;
        }
    EXPECT_GT(seen, 2 * rectified.width * rectified.height / 49 / 2);
  }
}

TEST(StereoRectification, RefusesRigsWithoutAStereoPair) {
  Random random(3);
  Rig rig = make_rig(random, false);
  EXPECT_THROW(rectify_stereo(rig, 0), InputError);
  Rig along = rig;
  along.body_from_camera[1] =
      along.body_from_camera[0] * SE3(Eigen::Quaterniond::Identity(), {0, 0, 1});
  EXPECT_THROW(rectify_stereo(along), InputError);
  rig.body_from_camera[1] = rig.body_from_camera[0];
  EXPECT_THROW(rectify_stereo(rig), InputError);
  rig.cameras.pop_back();
  EXPECT_THROW(rectify_stereo(rig), InputError);
}

}  // namespace
}  // namespace rover
