#pragma once

#include <array>

#include <opencv2/core/mat.hpp>

#include "rover/camera/camera.h"

namespace rover {

// Cameras 0 and 1 of a rig turned to look the same way, across their baseline, through one ideal
// pinhole: a point has the same row in both images, and its column differs by focal * baseline /
// depth px. For search and drawing only; residuals belong to the raw images.
struct StereoRectification {
  int width = 0;
  int height = 0;
  double focal = 0;                                      // px
  Eigen::Vector2d principal_point;                       // px, of both images
  double baseline = 0;                                   // m
  std::array<Eigen::Matrix3d, 2> rectified_from_camera;  // rotations
  // CV_32FC1, for cv::remap from the raw images; -1 where a camera sees nothing.
  std::array<cv::Mat, 2> map_x;
  std::array<cv::Mat, 2> map_y;

  // The rectified pixel of a unit bearing in the frame of camera 0 or 1. Nothing for bearings more
  // than 90 degrees off the rectified axis.
  std::optional<Eigen::Vector2d> project(int camera, const Eigen::Vector3d& bearing) const;
};

// Images have the size of camera 0's and `zoom` times the smaller focal length of the two; a zoom
// below 1 shows more of a fisheye's view. Throws InputError for a rig without two cameras, with
// less than 1 mm between them, or where one camera looks along the baseline, or for zoom <= 0.
StereoRectification rectify_stereo(const Rig& rig, double zoom = 1);

}  // namespace rover
