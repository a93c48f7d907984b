#include "rover/diagnosis/calibration_check.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace rover {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

// Degrees between the rays of two pixels on either side of the optical axis; 0 where there are
// none.
double angle_across(const Camera& camera, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const auto from = camera.unproject(a), to = camera.unproject(b);
  if (!from || !to) return 0;
  return kDegrees *
         (std::acos(std::clamp(from->z(), -1.0, 1.0)) + std::acos(std::clamp(to->z(), -1.0, 1.0)));
}

Eigen::Vector2d field_of_view(const Camera& camera) {
  const double cx = camera.intrinsics()[2], cy = camera.intrinsics()[3];
  return {angle_across(camera, {0, cy}, {camera.width() - 1.0, cy}),
          angle_across(camera, {cx, 0}, {cx, camera.height() - 1.0})};
}

// Share of the image whose pixels have a ray.
double usable_share(const Camera& camera) {
  constexpr int kSteps = 20;
  int usable = 0;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const Eigen::Vector2d pixel((camera.width() - 1.0) * i / kSteps,
                                  (camera.height() - 1.0) * j / kSteps);
      if (camera.unproject(pixel)) ++usable;
    }
  }
  return usable / static_cast<double>((kSteps + 1) * (kSteps + 1));
}

void check_view(const Camera& camera, int index, Topic& topic) {
  const bool pinhole = camera.model() == CameraModel::kPinhole;
  const Eigen::Vector2d view = field_of_view(camera);
  const bool sane = view.x() > 15 && view.x() < (pinhole ? 150 : 240);
  topic.add(sane ? Severity::kOk : Severity::kWarning, fmt::format("field_of_view_{}", index),
            fmt::format("camera {}: {}x{} px, {}, focal length {:.1f} x {:.1f} px, sees {:.0f} x "
                        "{:.0f} degrees",
                        index, camera.width(), camera.height(), pinhole ? "pinhole" : "fisheye",
                        camera.intrinsics()[0], camera.intrinsics()[1], view.x(), view.y()),
            "hardly any camera has such a field of view: look whether focal lengths are in pixels "
            "of this image size",
            view.x());
}

void check_intrinsics(const Camera& camera, int index, Topic& topic) {
  const auto& [fx, fy, cx, cy] = camera.intrinsics();
  const double squeeze = std::abs(fx / fy - 1);
  if (squeeze > 0.03)
    topic.add(judge_above(squeeze, 0.03, 0.1), fmt::format("focal_ratio_{}", index),
              fmt::format("camera {}: focal lengths differ by {:.0f}%", index, 100 * squeeze),
              "pixels are square on nearly all sensors: calibrate anew, or were images scaled?",
              squeeze);
  const double shift =
      std::max(std::abs(cx / camera.width() - 0.5), std::abs(cy / camera.height() - 0.5));
  if (shift > 0.1)
    topic.add(judge_above(shift, 0.1, 0.2), fmt::format("principal_point_{}", index),
              fmt::format("camera {}: the principal point ({:.1f}, {:.1f}) lies {:.0f}% of the "
                          "image off its centre",
                          index, cx, cy, 100 * shift),
              "look whether the images were cropped or scaled after calibration", shift);
}

void check_distortion(const Camera& camera, int index, Topic& topic) {
  const double share = usable_share(camera);
  if (share == 1) return;
  // A fisheye's image circle may well end inside the image.
  const bool pinhole = camera.model() == CameraModel::kPinhole;
  topic.add(pinhole && share < 0.95 ? Severity::kWarning : Severity::kNote,
            fmt::format("distortion_{}", index),
            fmt::format("camera {}: the distortion model covers {:.1f}% of the image; features "
                        "beyond are not used",
                        index, 100 * share),
            "calibrate with views that fill the corners, or use the fisheye model", share);
}

// Where a direction points, in the words of somebody who stands behind the camera.
std::string side_of(const Eigen::Vector3d& direction) {
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  const bool positive = direction[axis] > 0;
  if (axis == 0) return positive ? "to the right" : "to the left";
  if (axis == 1) return positive ? "below" : "above";
  return positive ? "in front" : "behind";
}

bool is_rectified(const Rig& rig, const SE3& left_from_right) {
  const auto no_distortion = [](const Camera& camera) {
    return camera.model() == CameraModel::kPinhole &&
           std::all_of(camera.distortion().begin(), camera.distortion().end(),
                       [](double k) { return k == 0; });
  };
  const Eigen::Vector3d direction = left_from_right.translation.normalized();
  return no_distortion(rig.cameras[0]) && no_distortion(rig.cameras[1]) &&
         rig.cameras[0].intrinsics() == rig.cameras[1].intrinsics() &&
         so3_log(left_from_right.rotation).norm() < 1e-6 && std::abs(direction.x()) > 1 - 1e-9;
}

void check_pair(const Rig& rig, Topic& topic) {
  const SE3 left_from_right = rig.body_from_camera[0].inverse() * rig.body_from_camera[1];
  const double baseline = rig.baseline();
  const bool sane = baseline > 0.01 && baseline < 3;
  topic.add(
      sane ? Severity::kOk : Severity::kWarning, "baseline",
      fmt::format("stereo: camera 1 lies {:.4f} m {} of camera 0, at {} in its axes; {}", baseline,
                  side_of(left_from_right.translation), format_vector(left_from_right.translation),
                  is_rectified(rig, left_from_right) ? "images are rectified"
                                                     : "images are raw, not rectified"),
      "lengths are metres: a rig in millimetres, or twice the same transform, looks so", baseline);
  const Eigen::Vector3d axis = left_from_right.rotation * Eigen::Vector3d::UnitZ();
  const double angle = kDegrees * std::acos(std::clamp(axis.z(), -1.0, 1.0));
  topic.add(judge_above(angle, 10, 40), "stereo_angle",
            fmt::format("stereo: the optical axes are {:.2f} degrees apart", angle),
            "cameras that look different ways share little of the scene", angle);
}

void check_place(const SE3& body_from_camera, Topic& topic) {
  const double distance = body_from_camera.translation.norm();
  topic.add(judge_above(distance, 0.5, 3), "lever_arm",
            fmt::format("camera 0 lies {:.3f} m from the inertial sensor, at {} in its axes",
                        distance, format_vector(body_from_camera.translation)),
            "lengths are metres: look at the translation of T_BS or T_cam_imu", distance);
}

}  // namespace

void check_calibration(const Rig& rig, bool inertial, Findings& findings) {
  Topic topic("calibration", findings);
  for (int i = 0; i < rig.size(); ++i) {
    const Camera& camera = rig.cameras[static_cast<std::size_t>(i)];
    check_view(camera, i, topic);
    check_intrinsics(camera, i, topic);
    check_distortion(camera, i, topic);
  }
  if (rig.size() > 1) check_pair(rig, topic);
  if (inertial) check_place(rig.body_from_camera[0], topic);
}

}  // namespace rover
