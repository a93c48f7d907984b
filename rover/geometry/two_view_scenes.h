#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "rover/geometry/essential.h"
#include "rover/geometry/random_geometry.h"

// Two views of made scenes, for the tests of what estimates motion from them.
namespace rover::two_view_scenes {

inline constexpr double kSigma = 0.5 / 450;  // rad: keypoints of half a pixel

struct View {
  double max_angle;  // of bearings from the axis
};
inline constexpr View kPinhole = {0.65}, kFisheye = {1.7};

inline Eigen::Vector3d bearing_in_view(Random& random, View view) {
  while (true) {
    const Eigen::Vector3d d = random_direction(random);
    if (std::acos(d.z()) < view.max_angle) return d;
  }
}

struct Scene {
  SE3 second_from_first;
  std::vector<BearingPair> pairs;
  int outliers = 0;
};

using Depth = std::function<double(const Eigen::Vector3d& bearing)>;

// The first camera sees points at a depth along its bearings; both see them in their view.
inline Scene make_scene(Random& random, const SE3& second_from_first, const Depth& depth, View view,
                        int count, double outliers, double sigma) {
  Scene scene{second_from_first, {}, static_cast<int>(outliers * count)};
  while (static_cast<int>(scene.pairs.size()) < count) {
    const Eigen::Vector3d first = bearing_in_view(random, view);
    const double distance = depth(first);
    if (!(distance > 0 && distance < 100)) continue;
    const Eigen::Vector3d second = (second_from_first * (distance * first)).normalized();
    if (std::acos(second.z()) > view.max_angle) continue;
    const bool outlier = static_cast<int>(scene.pairs.size()) < scene.outliers;
    scene.pairs.push_back(
        {disturb_bearing(first, sigma, random),
         outlier ? bearing_in_view(random, view) : disturb_bearing(second, sigma, random)});
  }
  return scene;
}

inline SE3 random_motion(Random& random, double baseline) {
  return {random_rotation(random, 0.15), baseline * random_direction(random)};
}

inline SE3 sideways(Random& random, double baseline) {
  Eigen::Vector3d t = random_direction(random);
  t.z() *= 0.2;
  return {random_rotation(random, 0.1), baseline * t.normalized()};
}

inline Depth cloud(Random& random) {
  return [&random](const Eigen::Vector3d&) { return random.uniform(2, 8); };
}

// A plane at distance d with this unit normal, seen from the first camera.
inline Depth plane(const Eigen::Vector3d& normal, double d) {
  return [=](const Eigen::Vector3d& bearing) { return d / normal.dot(bearing); };
}

}  // namespace rover::two_view_scenes
