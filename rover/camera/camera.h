#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "rover/geometry/se3.h"

namespace rover {

enum class CameraModel { kPinhole, kFisheye };

using Matrix23d = Eigen::Matrix<double, 2, 3>;

// A calibrated camera: pixels from rays and back. Pixel (0, 0) is the centre of the upper left
// pixel; the camera frame is x right, y down, z forward. Value type, cheap to copy.
//
// kPinhole: fx fy cx cy with radial-tangential distortion k1 k2 p1 p2 [k3] (OpenCV's and Kalibr's
// radtan). Beyond the radius where the distortion polynomial stops growing, project reports
// nothing. kFisheye: fx fy cx cy with Kannala-Brandt k1 k2 k3 k4 (OpenCV's fisheye, Kalibr's equi);
// it sees up to the angle where its polynomial stops growing, beyond 90 degrees where that allows.
// No coefficients at all mean zeros.
class Camera {
 public:
  // Throws InputError for sizes, focal lengths or coefficients that make no sense.
  Camera(CameraModel model, int width, int height, const std::array<double, 4>& intrinsics,
         const std::vector<double>& distortion);

  CameraModel model() const { return model_; }
  int width() const { return width_; }
  int height() const { return height_; }
  const std::array<double, 4>& intrinsics() const { return intrinsics_; }
  const std::array<double, 5>& distortion() const { return distortion_; }
  double focal_length() const { return 0.5 * (intrinsics_[0] + intrinsics_[1]); }

  // The pixel of a point in the camera frame (any positive length) and, if asked for, its Jacobian
  // by the point. Nothing for points that the model cannot see: behind the camera (pinhole), or
  // where distortion folds back. The pixel may lie outside the image: see contains().
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point,
                                         Matrix23d* jacobian = nullptr) const;

  // The unit ray of a pixel. Nothing where the distortion has no inverse.
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const;

  // Whether a pixel lies at least `border` px inside the centres of the outermost pixels, where
  // the image can be interpolated.
  bool contains(const Eigen::Vector2d& pixel, double border = 0) const;

 private:
  CameraModel model_;
  int width_;
  int height_;
  std::array<double, 4> intrinsics_;
  std::array<double, 5> distortion_{};
  double max_radius_;  // of the undistorted normalised plane (pinhole) or angle (fisheye)
};

// Cameras that are rigidly joined, with their place in the body frame. In visual modes the body
// frame is camera 0.
struct Rig {
  std::vector<Camera> cameras;
  std::vector<SE3> body_from_camera;

  int size() const { return static_cast<int>(cameras.size()); }
  // Distance between cameras 0 and 1 in metres; 0 for one camera.
  double baseline() const;
  // The same rig with the body frame moved into camera 0, as visual modes want it. Poses of the
  // body then need move_frame(trajectory, body_from_camera[0]) with the rig as it was.
  Rig in_camera_frame() const;
};

}  // namespace rover
