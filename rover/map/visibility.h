#pragma once

#include <optional>

#include <Eigen/Core>

#include "rover/camera/camera.h"
#include "rover/map/landmark.h"

namespace rover {

// Where a landmark is expected in a frame; nothing if it cannot be seen from there (behind, outside
// the image, from too different a direction).
std::optional<Eigen::Vector2d> predict_pixel(const Landmark& landmark, const Camera& camera,
                                             const SE3& world_from_camera, double max_view_angle);

}  // namespace rover
