#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "rover/camera/camera.h"
#include "rover/matching/matcher.h"

namespace rover {

// The ray of a feature and how pixels move with it; all that epipolar geometry asks of a feature,
// whatever the camera model.
struct ObservedRay {
  bool valid = false;                                   // false where the pixel has no ray
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // unit, camera frame
  Matrix23d jacobian = Matrix23d::Zero();               // px by the direction
};

std::vector<ObservedRay> observe_rays(const Camera& camera,
                                      std::span<const Eigen::Vector2f> positions);

// How far a ray of camera b lies from the epipolar plane of a ray of camera a, in px of image b (to
// first order). normal: unit normal of that plane in b's frame.
double plane_distance(const Eigen::Vector3d& normal, const ObservedRay& ray);

// The same from the two rays; the larger of the distances in both images. Infinite for invalid
// rays; 0 where the ray of a is the baseline itself.
double epipolar_distance(const ObservedRay& a, const ObservedRay& b, const SE3& b_from_a);

// Keeps the matches whose epipolar distance is at most max_distance px and whose point lies in
// front of both cameras (or too far away to tell).
std::vector<Match> epipolar_inliers(std::span<const Match> matches, std::span<const ObservedRay> a,
                                    std::span<const ObservedRay> b, const SE3& b_from_a,
                                    double max_distance);

}  // namespace rover
