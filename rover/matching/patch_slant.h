#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "rover/matching/patch_refinement.h"

namespace rover {

// How the small plane that a patch shows leans: the tangents of the angles between its normal (the
// one that points away from the camera) and the patch's central ray, towards the patch's right and
// down. Zero: it faces the camera.
struct Slant {
  static constexpr float kPriorSigma = 0.7f;  // 35 degrees: of a surface that nothing is known of

  Eigen::Vector2f mean = Eigen::Vector2f::Zero();
  Eigen::Matrix2f information = Eigen::Matrix2f::Identity() / (kPriorSigma * kPriorSigma);
};

// The linear warp from offsets in a patch to offsets in an image, given the patch's slant. It is
// linear in that too, for a patch that is small against its distance.
struct SlantedWarp {
  Eigen::Matrix2f facing;                    // without slant
  std::array<Eigen::Matrix2f, 2> per_slant;  // its change per unit of each component

  Eigen::Matrix2f at(const Eigen::Vector2f& slant) const {
    return facing + slant.x() * per_slant[0] + slant.y() * per_slant[1];
  }
};

struct SlantOptions {
  int half_window = 7;  // px: 15x15 of the patch; more than for a place, as slant shows at the rim
  int max_iterations = 6;
  float min_leverage = 0.25f;  // px that a slant of 1 moves the rim by; below, a view says nothing
  float min_step = 0.02f;      // px, and of the slant: the iteration stops below it
  float max_shift = 1.0f;      // px from the initial place; farther: not converged
  float max_slant = 2.5f;      // 68 degrees; more: not seen as a plane
  float min_correlation = 0.8f;  // normalised cross-correlation at the end
  float min_contrast = 2.0f;  // gray levels, standard deviation of patch and image: less is noise
  // Of the information that samples with independent errors would give. What does not fit is mostly
  // relief, not noise: alike in neighbouring samples, and in the next view.
  float information_share = 0.1f;
  float min_sigma = 0.05f;  // no patch is as flat as to lean by one angle known better than that

  void check() const;
};

// What a view from elsewhere says of a patch's slant, on top of what was known: least squares
// (Gauss and Newton) over place, slant, gain and bias, with the slant's own prior. place: px, where
// the patch is seen. Nothing where the view says nothing or the patch does not fit.
std::optional<Slant> update_slant(const ReferencePatch& patch, const cv::Mat& image,
                                  const Eigen::Vector2f& place, const SlantedWarp& warp,
                                  const Slant& before, const SlantOptions& options);

}  // namespace rover
