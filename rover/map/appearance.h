#pragma once

#include <memory>
#include <optional>

#include "rover/camera/camera.h"
#include "rover/map/frame.h"
#include "rover/map/landmark.h"

namespace rover {

// What the landmark behind a feature of a frame looks like; null where the camera model has no ray
// for the feature. Without an image there is no patch.
std::shared_ptr<const Appearance> make_appearance(const Camera& camera, const Frame& frame,
                                                  int feature);

// The linear warp from offsets in a landmark's patch to offsets in an image of `camera`: the patch
// is taken as a small plane that faced the reference camera. Nothing if it cannot be seen.
std::optional<Eigen::Matrix2f> patch_warp(const Landmark& landmark, const Camera& camera,
                                          const SE3& camera_from_world);

// Moves an observation of a landmark to where the landmark's patch fits the frame's image best, and
// sets its uncertainty. False (and nothing changed) where that does not converge.
bool refine_observation(const Landmark& landmark, const Camera& camera,
                        const SE3& camera_from_world, const cv::Mat& image,
                        const PatchRefinementOptions& options, Observation& observation);

}  // namespace rover
