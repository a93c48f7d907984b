#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace rover {

// A small window of a reference image around a landmark's first (or best) observation. Large enough
// to be warped. Copied out of the image, so that images need not be kept.
struct ReferencePatch {
  static constexpr int kSize = 25;  // px, odd; the centre sample is the (sub-pixel) feature
  std::array<std::uint8_t, std::size_t{kSize} * kSize> pixels{};
};

// Cuts a patch centred at a sub-pixel position (bilinear). Nothing if it leaves the image.
std::optional<ReferencePatch> cut_patch(const cv::Mat& image, const Eigen::Vector2f& position);

struct PatchRefinementOptions {
  int half_window = 5;  // px: an 11x11 window of the patch is aligned
  int max_iterations = 10;
  float max_sigma = 1.0f;        // px: less certain results (edges, plain walls) are refused
  float max_shift = 1.0f;        // px from the initial position; farther: not converged
  float min_step = 0.02f;        // px: the iteration stops below it
  float min_correlation = 0.8f;  // normalised cross-correlation at the end
  float min_sigma = 0.05f;       // px, floor of the reported uncertainty

  void check() const;
};

struct RefinedPosition {
  Eigen::Vector2f position;  // px
  float sigma = 0;           // px per axis, from the residual and the patch's structure tensor
  float correlation = 0;     // normalised cross-correlation at the end, at most 1
};

// Aligns the reference patch with an image by inverse-compositional Lucas and Kanade (Baker and
// Matthews 2004) over position, gain and bias, starting from `initial`.
// image_from_patch: the 2x2 linear warp from patch offsets to image offsets (identity when the
// viewpoint is the same). Nothing where it does not converge.
std::optional<RefinedPosition> refine_position(const ReferencePatch& patch, const cv::Mat& image,
                                               const Eigen::Vector2f& initial,
                                               const Eigen::Matrix2f& image_from_patch,
                                               const PatchRefinementOptions& options);

}  // namespace rover
