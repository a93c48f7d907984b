#include "rover/camera/stereo_rectification.h"

#include <algorithm>

#include "rover/base/error.h"

namespace rover {
namespace {

// Axes of the rectified cameras in the body frame, as rows: x along the baseline, z as near to both
// optical axes as that allows.
Eigen::Matrix3d rectified_from_body(const Rig& rig) {
  const SE3 &left = rig.body_from_camera[0], &right = rig.body_from_camera[1];
  const Eigen::Vector3d x = (right.translation - left.translation).normalized();
  const Eigen::Vector3d ahead =
      left.rotation * Eigen::Vector3d::UnitZ() + right.rotation * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d z = ahead - x * x.dot(ahead);
  require(z.norm() > 0.2, "stereo rectification: the cameras look along their baseline");
  Eigen::Matrix3d axes;
  axes << x.transpose(), z.normalized().cross(x).transpose(), z.normalized().transpose();
  return axes;
}

void fill_maps(const Camera& camera, int index, StereoRectification* result) {
  cv::Mat& map_x = result->map_x[index];
  cv::Mat& map_y = result->map_y[index];
  map_x.create(result->height, result->width, CV_32FC1);
  map_y.create(result->height, result->width, CV_32FC1);
  const Eigen::Matrix3d camera_from_rectified = result->rectified_from_camera[index].transpose();
  for (int v = 0; v < result->height; ++v)
    for (int u = 0; u < result->width; ++u) {
      const Eigen::Vector2d plane =
          (Eigen::Vector2d(u, v) - result->principal_point) / result->focal;
      const auto pixel = camera.project(camera_from_rectified * plane.homogeneous());
      map_x.at<float>(v, u) = pixel ? static_cast<float>(pixel->x()) : -1.0f;
      map_y.at<float>(v, u) = pixel ? static_cast<float>(pixel->y()) : -1.0f;
    }
}

}  // namespace

std::optional<Eigen::Vector2d> StereoRectification::project(int camera,
                                                            const Eigen::Vector3d& bearing) const {
  const Eigen::Vector3d turned = rectified_from_camera.at(camera) * bearing;
  if (!(turned.z() > 0)) return std::nullopt;
  return focal * turned.head<2>() / turned.z() + principal_point;
}

StereoRectification rectify_stereo(const Rig& rig, double zoom) {
  require(rig.size() >= 2, "stereo rectification: the rig has no second camera");
  require(rig.baseline() > 1e-3, "stereo rectification: the cameras are less than 1 mm apart");
  require(zoom > 0, "stereo rectification: zoom must be positive");
  StereoRectification result;
  result.width = rig.cameras[0].width();
  result.height = rig.cameras[0].height();
  result.focal = zoom * std::min(rig.cameras[0].focal_length(), rig.cameras[1].focal_length());
  result.principal_point = {0.5 * (result.width - 1), 0.5 * (result.height - 1)};
  result.baseline = rig.baseline();
  const Eigen::Matrix3d from_body = rectified_from_body(rig);
  for (int i = 0; i < 2; ++i) {
    result.rectified_from_camera[i] = from_body * rig.body_from_camera[i].rotation_matrix();
    fill_maps(rig.cameras[i], i, &result);
  }
  return result;
}

}  // namespace rover
