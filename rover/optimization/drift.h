#pragma once

#include <Eigen/Core>

#include "rover/geometry/se3.h"

namespace rover {

// Where an upright map has drifted to since it began: nothing that is measured tells its position
// and its turn about the vertical. A drift moves points to p + t + a z x p; its covariance is that
// of (t, a). Seen from the world's origin, neighbours drift alike: so it can be handed from
// keyframe to keyframe as it is, and all its shrinking is knowledge gained.

// The drift that an uncertain pose (body frame, translation and rotation) amounts to.
Eigen::Matrix4d drift_of(const SE3& world_from_body, const Matrix6d& covariance);

// The covariance of a pose that drifts with the map around it, which alone it is conditional on.
Matrix6d with_drift(const SE3& world_from_body, const Matrix6d& covariance,
                    const Eigen::Matrix4d& drift);

// The first with as much added as makes it no less than the second in any direction.
Eigen::Matrix4d at_least(const Eigen::Matrix4d& covariance, const Eigen::Matrix4d& other);

}  // namespace rover
