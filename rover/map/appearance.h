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

// The warp from offsets in a landmark's patch to offsets in an image of `camera`, by the slant of
// the small plane that the patch is taken for. Nothing if it cannot be seen.
std::optional<SlantedWarp> slanted_warp(const Landmark& landmark, const Camera& camera,
                                        const SE3& camera_from_world);

// Moves an observation of a landmark to where the landmark's patch fits the frame's image best, and
// sets its uncertainty. Alignment starts where the landmark is expected (the pose, from many
// landmarks, is known better than a feature's place in a view that has changed), or else at the
// feature. False (and nothing changed) where neither converges.
bool refine_observation(const Landmark& landmark, const Camera& camera,
                        const SE3& camera_from_world, const cv::Mat& image,
                        const PatchRefinementOptions& options, Observation& observation);

// The slant of a landmark's patch, with what this view adds to what was known. Nothing where it
// adds nothing.
std::optional<Slant> learn_slant(const Landmark& landmark, const Camera& camera,
                                 const SE3& camera_from_world, const cv::Mat& image,
                                 const SlantOptions& options, const Observation& observation);

}  // namespace rover
