#include "rover/matching/patch_refinement.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

#include "rover/base/error.h"
#include "rover/matching/bilinear.h"
#include "rover/matching/kernels.h"

namespace rover {

void PatchRefinementOptions::check() const {
  require(half_window >= 2 && 2 * half_window + 1 <= AlignmentTemplate::kMaxWindow,
          "patch refinement: half_window must be 2 to {}, not {}",
          AlignmentTemplate::kMaxWindow / 2, half_window);
  require(max_iterations >= 1, "patch refinement: max_iterations must be positive, not {}",
          max_iterations);
  require(max_shift > 0 && min_step > 0,
          "patch refinement: max_shift {} and min_step {} must be positive", max_shift, min_step);
  require(min_correlation >= 0 && min_correlation < 1,
          "patch refinement: min_correlation must be in [0, 1), not {}", min_correlation);
  require(min_sigma > 0 && max_sigma > min_sigma,
          "patch refinement: 0 < min_sigma < max_sigma does not hold for {}, {}", min_sigma,
          max_sigma);
}

std::optional<ReferencePatch> cut_patch(const cv::Mat& image, const Eigen::Vector2f& position) {
  constexpr int kSize = ReferencePatch::kSize;
  constexpr float kRadius = (kSize - 1) / 2.0f, kHalf = 0.5f;  // half a level: rounds
  const float left = position.x() - kRadius, top = position.y() - kRadius;
  // Written so that a position that is not a number fails too.
  if (!(left >= 0 && top >= 0 && left + kSize < static_cast<float>(image.cols) &&
        top + kSize < static_cast<float>(image.rows))) {
    return std::nullopt;
  }
  const int x = static_cast<int>(left), y = static_cast<int>(top);
  const float fx = left - static_cast<float>(x), fy = top - static_cast<float>(y);
  const float w00 = (1 - fx) * (1 - fy), w01 = fx * (1 - fy), w10 = (1 - fx) * fy, w11 = fx * fy;
  ReferencePatch patch;
  for (int r = 0; r < kSize; ++r) {
    const auto* upper = image.ptr<std::uint8_t>(y + r) + x;
    const auto* lower = image.ptr<std::uint8_t>(y + r + 1) + x;
    for (int c = 0; c < kSize; ++c) {
      const float value =
          w00 * static_cast<float>(upper[c]) + w01 * static_cast<float>(upper[c + 1]) +
          w10 * static_cast<float>(lower[c]) + w11 * static_cast<float>(lower[c + 1]);
      patch.pixels[r * kSize + c] = static_cast<std::uint8_t>(kHalf + value);
    }
  }
  return patch;
}

namespace {

constexpr int kStride = AlignmentTemplate::kStride;

// The patch as the image should show it, and what the iteration needs of it. Gain and bias are
// solved for in closed form: the gradients are made orthogonal to the intensities and to a
// constant, so that both drop out of the equation for the shift.
struct Template {
  AlignmentTemplate planes;     // intensity has mean 0
  float mean = 0;               // gray level
  float norm_squared = 0;       // of the intensities
  Eigen::Matrix2f information;  // of the orthogonal gradients
  Eigen::Matrix2f inverse;
  int count = 0;  // samples

  bool usable() const {
    return norm_squared > static_cast<float>(count) && information.determinant() > 0;
  }
};

// Samples of the patch on the pixel grid of the image, one more on each side for the gradients.
// False if the warp leaves the patch.
bool warp_patch(const ReferencePatch& patch, const Eigen::Matrix2f& patch_from_image, int half,
                float* samples) {
  constexpr int kSize = ReferencePatch::kSize;
  constexpr float kCentre = (kSize - 1) / 2.0f;
  const float reach =
      static_cast<float>(half) * patch_from_image.cwiseAbs().rowwise().sum().maxCoeff();
  if (!(reach < kCentre - 0.01f)) return false;  // 0.01: rounding along the rows below
  const Eigen::Vector2f step = patch_from_image.col(0);
  for (int r = -half; r <= half; ++r) {
    Eigen::Vector2f at = patch_from_image * Eigen::Vector2f(-half, r);
    at.array() += kCentre;
    for (int c = -half; c <= half; ++c, at += step) {
      const int x = static_cast<int>(at.x()), y = static_cast<int>(at.y());
      const float fx = at.x() - static_cast<float>(x), fy = at.y() - static_cast<float>(y);
      *samples++ = BilinearCell(&patch.pixels[y * kSize + x], kSize, fx, fy).value();
    }
  }
  return true;
}

// Fills the planes with intensities and central differences.
void fill_planes(const float* samples, int window, AlignmentTemplate& planes) {
  const int width = window + 2;
  planes.window = window;
  std::fill_n(planes.inside, window, 1.0f);
  for (int r = 0; r < window; ++r) {
    const float* row = &samples[(r + 1) * width + 1];
    for (int c = 0; c < window; ++c) {
      planes.intensity[r * kStride + c] = row[c];
      planes.gradient_x[r * kStride + c] = 0.5f * (row[c + 1] - row[c - 1]);
      planes.gradient_y[r * kStride + c] = 0.5f * (row[c + width] - row[c - width]);
    }
  }
}

// A plane's used rows; the padding is zero and stays so under the operations below, except where a
// constant is subtracted.
using Plane = Eigen::Map<Eigen::Matrix<float, Eigen::Dynamic, kStride, Eigen::RowMajor>>;

void remove_mean(Plane plane, int window) {
  plane.leftCols(window).array() -= plane.sum() / static_cast<float>(window * window);
}

Template make_template(const float* samples, int window) {
  Template made;
  fill_planes(samples, window, made.planes);
  Plane intensity(made.planes.intensity, window, kStride);
  Plane gx(made.planes.gradient_x, window, kStride), gy(made.planes.gradient_y, window, kStride);
  made.count = window * window;
  made.mean = intensity.sum() / static_cast<float>(made.count);
  remove_mean(intensity, window);
  made.norm_squared = intensity.squaredNorm();
  for (Plane gradient : {gx, gy}) {
    remove_mean(gradient, window);
    const float along = gradient.cwiseProduct(intensity).sum() / std::max(made.norm_squared, 1e-6f);
    gradient -= along * intensity;
  }
  const float xy = gx.cwiseProduct(gy).sum();
  made.information << gx.squaredNorm(), xy, xy, gy.squaredNorm();
  made.inverse = made.information.inverse();
  return made;
}

// What one evaluation says: the window at the current position = gain * template + bias + residual.
struct Fit {
  float gain;
  float image_share;  // of noise left after interpolation
  float correlation;
  float residual_square;
  Eigen::Vector2f shift;  // of the template within the window, px
};

Fit evaluate(const AlignmentSums& sums, const Template& reference, float image_share) {
  const float count = static_cast<float>(reference.count);
  const float variation = std::max(sums.image_square - sums.image * sums.image / count, 1e-6f);
  Fit fit;
  fit.image_share = image_share;
  fit.gain = sums.image_template / reference.norm_squared;
  fit.correlation = sums.image_template / std::sqrt(variation * reference.norm_squared);
  fit.residual_square = std::max(variation - fit.gain * sums.image_template, 0.0f);
  fit.shift = reference.inverse * Eigen::Vector2f(sums.image_gradient_x, sums.image_gradient_y) /
              std::max(std::abs(fit.gain), 1e-3f);
  return fit;
}

// The share of the variance of white noise that bilinear interpolation leaves.
float noise_share(float fraction_x, float fraction_y) {
  const auto share = [](float f) { return 1 - 2 * f + 2 * f * f; };
  return share(fraction_x) * share(fraction_y);
}

// The root of the mean eigenvalue of the position's covariance. Two effects make plain least
// squares (residual variance * inverse information) report half of the true variance in dark
// images: interpolation takes away noise from the residual that the gradients, being of lower
// frequency, still see; and noise in the template adds to its information. Infinite if noise is
// all there is.
float position_sigma(const Fit& fit, const Template& reference, float image_share) {
  constexpr float kTemplateShare = 4.0f / 9.0f;  // mean over all fractions that it was cut at
  const float shares = image_share + kTemplateShare;
  const float variance =
      fit.residual_square / (static_cast<float>(reference.count - 4) * fit.gain * fit.gain);
  const float gradient_noise = 0.5f * variance * kTemplateShare / shares;  // central differences
  const Eigen::Matrix2f clean = reference.information - static_cast<float>(reference.count) *
                                                            gradient_noise *
                                                            Eigen::Matrix2f::Identity();
  if (clean.determinant() <= 0 || clean.trace() <= 0) return std::numeric_limits<float>::infinity();
  return std::sqrt(clean.inverse().trace() * variance / shares);
}

class Alignment {
 public:
  Alignment(const cv::Mat& image, const Template& reference, const PatchRefinementOptions& options)
      : image_(image), reference_(reference), options_(options) {}

  std::optional<RefinedPosition> run(const Eigen::Vector2f& initial) const {
    Eigen::Vector2f position = initial;
    for (int i = 0; i < options_.max_iterations; ++i) {
      const auto fit = fit_at(position);
      if (!fit) return std::nullopt;
      // A window far off the template asks for steps that the linearisation does not support.
      const float norm = fit->shift.norm();
      position -= fit->shift * std::min(1.0f, kMaxStep / std::max(norm, 1e-6f));
      if (!((position - initial).norm() <= options_.max_shift)) return std::nullopt;
      if (norm < options_.min_step) return accept(position, *fit);
    }
    return std::nullopt;
  }

 private:
  static constexpr float kMaxStep = 1.5f;  // px

  std::optional<Fit> fit_at(const Eigen::Vector2f& position) const {
    const int half = reference_.planes.window / 2;
    const float left = position.x() - static_cast<float>(half);
    const float top = position.y() - static_cast<float>(half);
    const auto window = static_cast<float>(reference_.planes.window);
    if (!(left >= 0 && top >= 0 && left + window < static_cast<float>(image_.cols) &&
          top + window < static_cast<float>(image_.rows))) {
      return std::nullopt;
    }
    const int x = static_cast<int>(left), y = static_cast<int>(top);
    const float fx = left - static_cast<float>(x), fy = top - static_cast<float>(y);
    const AlignmentSums sums = matching_kernels().align(image_.ptr<std::uint8_t>(y) + x,
                                                        static_cast<std::ptrdiff_t>(image_.step[0]),
                                                        fx, fy, reference_.mean, reference_.planes);
    return evaluate(sums, reference_, noise_share(fx, fy));
  }

  std::optional<RefinedPosition> accept(const Eigen::Vector2f& position, const Fit& fit) const {
    if (fit.gain <= 0 || fit.correlation < options_.min_correlation) return std::nullopt;
    const float sigma = position_sigma(fit, reference_, fit.image_share);
    if (!(sigma <= options_.max_sigma)) return std::nullopt;
    return RefinedPosition{position, std::max(sigma, options_.min_sigma),
                           std::min(fit.correlation, 1.0f)};
  }

  const cv::Mat& image_;
  const Template& reference_;
  const PatchRefinementOptions& options_;
};

}  // namespace

std::optional<RefinedPosition> refine_position(const ReferencePatch& patch, const cv::Mat& image,
                                               const Eigen::Vector2f& initial,
                                               const Eigen::Matrix2f& image_from_patch,
                                               const PatchRefinementOptions& options) {
  constexpr int kMaxWidth = AlignmentTemplate::kMaxWindow + 2;
  const Eigen::Matrix2f patch_from_image = image_from_patch.inverse();
  std::array<float, std::size_t{kMaxWidth} * kMaxWidth> samples;
  if (!warp_patch(patch, patch_from_image, options.half_window + 1, samples.data())) {
    return std::nullopt;
  }
  const Template reference = make_template(samples.data(), 2 * options.half_window + 1);
  if (!reference.usable()) return std::nullopt;
  return Alignment(image, reference, options).run(initial);
}

}  // namespace rover
