#include "rover/camera/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/LU>

#include "rover/base/error.h"
#include "rover/camera/radial_polynomial.h"

namespace rover {
namespace {

using Coefficients = std::array<double, 5>;

// Beyond this radius of the normalised plane (89.99 degrees) no lens is looked at.
constexpr double kLargestRadius = 1e4;

// A point of the distorted plane and its Jacobian by the undistorted one.
struct Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d jacobian;
};

RadialPolynomial pinhole_polynomial(const Coefficients& d) {
  return RadialPolynomial({d[0], d[1], d[4], 0});
}

RadialPolynomial fisheye_polynomial(const Coefficients& d) {
  return RadialPolynomial({d[0], d[1], d[2], d[3]});
}

// Brown's model as OpenCV writes it (calib3d documentation, "Detailed Description").
Distorted distort(const Coefficients& d, const Eigen::Vector2d& p) {
  const RadialPolynomial radial = pinhole_polynomial(d);
  const double p1 = d[2], p2 = d[3], x = p.x(), y = p.y(), r2 = p.squaredNorm();
  const double factor = radial.factor(r2);
  Distorted result;
  result.point = factor * p + Eigen::Vector2d(2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                                              p1 * (r2 + 2 * y * y) + 2 * p2 * x * y);
  Eigen::Matrix2d tangential;
  tangential << 2 * p1 * y + 6 * p2 * x, 2 * p1 * x + 2 * p2 * y,  //
      2 * p1 * x + 2 * p2 * y, 6 * p1 * y + 2 * p2 * x;
  result.jacobian = factor * Eigen::Matrix2d::Identity() +
                    2 * radial.factor_slope(r2) * p * p.transpose() + tangential;
  return result;
}

// Tangential terms can fold the plane a little inside the radius where the polynomial does.
bool folded(const Distorted& distorted) { return !(distorted.jacobian.determinant() > 0); }

std::optional<Distorted> project_pinhole(const Coefficients& d, double max_radius,
                                         const Eigen::Vector3d& point, Matrix23d* jacobian) {
  if (!(point.z() > 0)) return std::nullopt;
  const double inverse = 1 / point.z();
  const Eigen::Vector2d normalised = inverse * point.head<2>();
  if (!(normalised.squaredNorm() < max_radius * max_radius)) return std::nullopt;
  const Distorted distorted = distort(d, normalised);
  if (folded(distorted)) return std::nullopt;
  if (jacobian) {
    const Eigen::Matrix2d scaled = inverse * distorted.jacobian;
    *jacobian << scaled, -scaled * normalised;
  }
  return distorted;
}

// Kannala and Brandt, "A generic camera model and calibration method" (2006), equation 6 with odd
// powers up to nine and first coefficient 1.
std::optional<Eigen::Vector2d> project_fisheye(const Coefficients& d, double max_angle,
                                               const Eigen::Vector3d& point, Matrix23d* jacobian) {
  const Eigen::Vector2d p = point.head<2>();
  const double radius = p.norm();
  const double angle = std::atan2(radius, point.z());
  if (!(angle < max_angle) || (radius == 0 && !(point.z() > 0))) return std::nullopt;
  const RadialPolynomial radial = fisheye_polynomial(d);
  const double scale = radius > 0 ? radial.value(angle) / radius : 1 / point.z();
  if (jacobian) {
    const double slope = radial.slope(angle) / point.squaredNorm();
    jacobian->leftCols<2>() = scale * Eigen::Matrix2d::Identity();
    if (radius > 0) {
      const Eigen::Vector2d direction = p / radius;
      jacobian->leftCols<2>() += (slope * point.z() - scale) * direction * direction.transpose();
    }
    jacobian->col(2) = -slope * p;
  }
  return Eigen::Vector2d(scale * p);
}

// Inverts the radial part exactly, then the whole by Newton's method from there.
std::optional<Eigen::Vector3d> unproject_pinhole(const Coefficients& d, double max_radius,
                                                 const Eigen::Vector2d& target) {
  const double target_radius = target.norm();
  if (!std::isfinite(target_radius)) return std::nullopt;
  const auto radius = pinhole_polynomial(d).invert(target_radius, max_radius);
  // Tangential terms can bring back a point that the radial part alone cannot reach.
  const double start = radius ? *radius : 0.99 * max_radius;
  Eigen::Vector2d p =
      target_radius > 0 ? Eigen::Vector2d(target * (start / target_radius)) : target;
  const double tolerance = 1e-14 * (1 + target_radius);
  constexpr int kMaxIterations = 30;
  for (int i = 0; i < kMaxIterations; ++i) {
    const Distorted distorted = distort(d, p);
    const Eigen::Vector2d error = distorted.point - target;
    if (folded(distorted) || !(p.norm() < max_radius)) return std::nullopt;
    if (error.norm() <= tolerance) break;
    p -= distorted.jacobian.inverse() * error;
  }
  const Distorted found = distort(d, p);
  const bool converged = (found.point - target).norm() <= 1e-9 * (1 + target_radius);
  if (!converged || folded(found) || !(p.norm() < max_radius)) return std::nullopt;
  return p.homogeneous().normalized();
}

std::optional<Eigen::Vector3d> unproject_fisheye(const Coefficients& d, double max_angle,
                                                 const Eigen::Vector2d& target) {
  const double target_radius = target.norm();
  const auto angle = fisheye_polynomial(d).invert(target_radius, max_angle);
  if (!angle) return std::nullopt;
  const double scale = target_radius > 0 ? std::sin(*angle) / target_radius : 1;
  return Eigen::Vector3d(scale * target.x(), scale * target.y(), std::cos(*angle)).normalized();
}

void check_size(CameraModel model, const std::vector<double>& distortion) {
  const auto count = distortion.size();
  if (model == CameraModel::kPinhole)
    require(count == 0 || count == 4 || count == 5,
            "a pinhole camera takes 4 or 5 distortion coefficients (k1 k2 p1 p2 [k3]) or none, "
            "not {}",
            count);
  else
    require(count == 0 || count == 4,
            "a fisheye camera takes 4 distortion coefficients (k1 k2 k3 k4) or none, not {}",
            count);
}

}  // namespace

Camera::Camera(CameraModel model, int width, int height, const std::array<double, 4>& intrinsics,
               const std::vector<double>& distortion)
    : model_(model), width_(width), height_(height), intrinsics_(intrinsics) {
  require(width > 0 && height > 0, "a camera's image cannot be {} x {} pixels", width, height);
  for (const double value : intrinsics)
    require(std::isfinite(value), "a camera's intrinsics fx fy cx cy must be finite numbers");
  require(intrinsics[0] > 0 && intrinsics[1] > 0,
          "a camera's focal lengths must be positive, not {} and {}", intrinsics[0], intrinsics[1]);
  check_size(model, distortion);
  for (const double value : distortion)
    require(std::isfinite(value), "a camera's distortion coefficients must be finite numbers");
  std::copy(distortion.begin(), distortion.end(), distortion_.begin());
  max_radius_ = model == CameraModel::kPinhole
                    ? pinhole_polynomial(distortion_).growing_until(kLargestRadius)
                    : std::min(std::numbers::pi,
                               fisheye_polynomial(distortion_).growing_until(std::numbers::pi));
}

std::optional<Eigen::Vector2d> Camera::project(const Eigen::Vector3d& point,
                                               Matrix23d* jacobian) const {
  const auto distorted = [&]() -> std::optional<Eigen::Vector2d> {
    if (model_ == CameraModel::kFisheye)
      return project_fisheye(distortion_, max_radius_, point, jacobian);
    const auto result = project_pinhole(distortion_, max_radius_, point, jacobian);
    return result ? std::optional(result->point) : std::nullopt;
  }();
  if (!distorted) return std::nullopt;
  if (jacobian) {
    jacobian->row(0) *= intrinsics_[0];
    jacobian->row(1) *= intrinsics_[1];
  }
  return Eigen::Vector2d(intrinsics_[0] * distorted->x() + intrinsics_[2],
                         intrinsics_[1] * distorted->y() + intrinsics_[3]);
}

std::optional<Eigen::Vector3d> Camera::unproject(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d plane((pixel.x() - intrinsics_[2]) / intrinsics_[0],
                              (pixel.y() - intrinsics_[3]) / intrinsics_[1]);
  return model_ == CameraModel::kPinhole ? unproject_pinhole(distortion_, max_radius_, plane)
                                         : unproject_fisheye(distortion_, max_radius_, plane);
}

bool Camera::contains(const Eigen::Vector2d& pixel, double border) const {
  return pixel.x() >= border && pixel.y() >= border && pixel.x() <= width_ - 1 - border &&
         pixel.y() <= height_ - 1 - border;
}

double Rig::baseline() const {
  if (size() < 2) return 0;
  return (body_from_camera[1].translation - body_from_camera[0].translation).norm();
}

Rig Rig::in_camera_frame() const {
  Rig moved = *this;
  const SE3 camera0_from_body = body_from_camera.at(0).inverse();
  for (SE3& pose : moved.body_from_camera) pose = camera0_from_body * pose;
  moved.body_from_camera[0] = SE3();  // without rounding
  return moved;
}

}  // namespace rover
