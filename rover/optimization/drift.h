#pragma once

#include <Eigen/Core>

#include "rover/geometry/sim3.h"

namespace rover {

// Where an upright map has drifted to since it began: nothing that is measured tells its position
// and its turn about the vertical. A drift moves points to p + t + a z x p; its covariance is that
// of (t, a). Seen from the world's origin, neighbours drift alike: so it can be handed from
// keyframe to keyframe as it is, and all its shrinking is knowledge gained.
//
// The surroundings of a keyframe are off by tilt and scale besides (map_error.h): by a similarity
// that moves points to p + t + w x p + s p, of which the covariance of (t, w, s) is kept.

// The drift that an uncertain pose (body frame, translation and rotation) amounts to.
Eigen::Matrix4d drift_of(const SE3& world_from_body, const Matrix6d& covariance);

// The covariance of a pose that drifts with the map around it, which alone it is conditional on.
Matrix6d with_drift(const SE3& world_from_body, const Matrix6d& covariance,
                    const Eigen::Matrix4d& drift);

// What a similarity amounts to at a place.
Eigen::Matrix4d drift_at(const Eigen::Vector3d& position, const Matrix7d& similarity);

// The similarity that moves a pose as its tangent (body frame) and the logarithm of scale say.
Matrix7d similarity_by_pose(const SE3& world_from_body);

// Tilt and scale alone.
Eigen::Matrix3d map_error_of(const Matrix7d& similarity);

// The first with as much added as makes it no less than the second in any direction: the same
// whatever the units and wherever the world's origin.
Eigen::Matrix4d at_least(const Eigen::Matrix4d& covariance, const Eigen::Matrix4d& other);

}  // namespace rover
