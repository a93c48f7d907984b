#include "rover/matching/patch_slant.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "rover/base/error.h"
#include "rover/matching/bilinear.h"

namespace rover {

void SlantOptions::check() const {
  require(half_window >= 2 && 2 * half_window + 1 <= ReferencePatch::kSize,
          "slant: half_window must be 2 to {}, not {}", ReferencePatch::kSize / 2, half_window);
  require(max_iterations >= 1, "slant: max_iterations must be positive, not {}", max_iterations);
  require(min_leverage > 0 && min_step > 0 && max_shift > 0 && max_slant > 0,
          "slant: min_leverage {}, min_step {}, max_shift {} and max_slant {} must be positive",
          min_leverage, min_step, max_shift, max_slant);
  require(min_correlation >= 0 && min_correlation < 1,
          "slant: min_correlation must be in [0, 1), not {}", min_correlation);
  require(information_share > 0 && information_share <= 1,
          "slant: information_share must be above 0 and at most 1, not {}", information_share);
  require(min_sigma > 0 && min_contrast > 0,
          "slant: min_sigma {} and min_contrast {} must be positive", min_sigma, min_contrast);
}

namespace {

// Of each sample: derivatives of the image by place (2) and slant (2), the patch's value, 1, the
// image's value; padded. The first six times the unknowns plus the image's value make a residual;
// the unknowns are the steps of place and slant, and gain and bias with a minus sign.
constexpr int kUnknowns = 6, kPatch = 4, kOne = 5, kImage = 6, kColumns = 8;
using Row = Eigen::Matrix<float, kColumns, 1>;
using Squares = Eigen::Matrix<float, kColumns, kColumns>;  // sums of row * row^T
using Matrix6d = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Matrix67d = Eigen::Matrix<double, kUnknowns, kImage + 1>;
using Vector6d = Eigen::Matrix<double, kUnknowns, 1>;

float covariance(const Squares& sums, int a, int b) {
  return sums(a, b) - sums(a, kOne) * sums(b, kOne) / sums(kOne, kOne);
}

float correlation(const Squares& sums) {
  const float variations = covariance(sums, kPatch, kPatch) * covariance(sums, kImage, kImage);
  return covariance(sums, kPatch, kImage) / std::sqrt(std::max(variations, 1e-6f));
}

class SlantAlignment {
 public:
  SlantAlignment(const ReferencePatch& patch, const cv::Mat& image, const SlantedWarp& warp,
                 const Slant& before, const SlantOptions& options)
      : patch_(patch), image_(image), warp_(warp), before_(before), options_(options) {}

  std::optional<Slant> run(const Eigen::Vector2f& initial) const {
    Eigen::Vector2f place = initial, slant = before_.mean;
    for (int i = 0; i < options_.max_iterations; ++i) {
      const auto sums = sum(place, slant);
      if (!sums || !has_contrast(*sums)) return std::nullopt;
      const Vector6d step = solve(*sums, slant);
      place += step.head<2>().cast<float>();
      slant += step.segment<2>(2).cast<float>();
      if (!((place - initial).norm() <= options_.max_shift && slant.norm() <= options_.max_slant)) {
        return std::nullopt;
      }
      if (step.head<4>().norm() < options_.min_step) return accept(*sums, slant);
    }
    return std::nullopt;
  }

 private:
  // Nothing if the window leaves the image.
  std::optional<Squares> sum(const Eigen::Vector2f& place, const Eigen::Vector2f& slant) const {
    const Eigen::Matrix2f warp = warp_.at(slant);
    const int half = options_.half_window;
    const float reach = static_cast<float>(half) * warp.cwiseAbs().rowwise().sum().maxCoeff();
    const float margin = reach + 0.01f;  // samples are rounded one by one
    if (!(warp.allFinite() && place.minCoeff() >= margin &&
          place.x() + margin + 1 < static_cast<float>(image_.cols) &&
          place.y() + margin + 1 < static_cast<float>(image_.rows))) {
      return std::nullopt;
    }
    constexpr int kSize = ReferencePatch::kSize, kCentre = kSize / 2;
    Squares sums = Squares::Zero();
    for (int y = -half; y <= half; ++y) {
      const std::uint8_t* reference = &patch_.pixels[(kCentre + y) * kSize + kCentre];
      for (int x = -half; x <= half; ++x) {
        const Eigen::Vector2f offset(x, y);
        const Row row = sample(place + warp * offset, offset, reference[x]);
        sums.noalias() += row * row.transpose();
      }
    }
    return sums;
  }

  Row sample(const Eigen::Vector2f& at, const Eigen::Vector2f& offset, float reference) const {
    constexpr float kMiddle = 128;  // gray level: keeps the sums small
    const int x = static_cast<int>(at.x()), y = static_cast<int>(at.y());
    const float fx = at.x() - static_cast<float>(x), fy = at.y() - static_cast<float>(y);
    const BilinearCell cell(image_.ptr<std::uint8_t>(y) + x, image_.step[0], fx, fy);
    const Eigen::Vector2f gradient = cell.gradient();
    const Eigen::Vector2f moved_right = warp_.per_slant[0] * offset;
    const Eigen::Vector2f moved_down = warp_.per_slant[1] * offset;
    Row row;
    row << gradient.x(), gradient.y(), gradient.dot(moved_right), gradient.dot(moved_down),
        reference - kMiddle, 1, cell.value() - kMiddle, 0;
    return row;
  }

  bool has_contrast(const Squares& sums) const {
    const float least = options_.min_contrast * options_.min_contrast * sums(kOne, kOne);
    return covariance(sums, kPatch, kPatch) >= least && covariance(sums, kImage, kImage) >= least;
  }

  // Of a sample, gray levels squared; larger than the residual's, as neighbours err alike.
  double variance(const Squares& sums) const {
    constexpr double kSensor = 1;  // noise and rounding
    const double unexplained = 1 - std::pow(correlation(sums), 2);
    const double residual = unexplained * covariance(sums, kImage, kImage);
    return std::max(kSensor, residual / (sums(kOne, kOne) - kUnknowns)) /
           options_.information_share;
  }

  // Left side and right side (with its sign turned, the last column) of the normal equation.
  Matrix67d equation(const Squares& sums) const {
    return sums.topLeftCorner<kUnknowns, kImage + 1>().cast<double>() / variance(sums);
  }

  Vector6d solve(const Squares& sums, const Eigen::Vector2f& slant) const {
    const Matrix67d samples = equation(sums);
    Matrix6d left = samples.leftCols<kUnknowns>();
    Vector6d right = -samples.col(kImage);
    const Eigen::Matrix2d prior = before_.information.cast<double>();
    left.block<2, 2>(2, 2) += prior;
    right.segment<2>(2) += prior * (before_.mean - slant).cast<double>();
    return left.ldlt().solve(right);
  }

  std::optional<Slant> accept(const Squares& sums, const Eigen::Vector2f& slant) const {
    if (!(correlation(sums) >= options_.min_correlation)) return std::nullopt;
    const Eigen::Matrix2f known = before_.information + seen_of_slant(sums);
    if (!known.allFinite()) return std::nullopt;
    return Slant{slant, limited(known)};
  }

  // What the samples say of the slant alone: place, gain and bias are free, the place within
  // max_shift.
  Eigen::Matrix2f seen_of_slant(const Squares& sums) const {
    Matrix6d all = equation(sums).leftCols<kUnknowns>();
    all.topLeftCorner<2, 2>().diagonal().array() += 1 / std::pow(options_.max_shift, 2);
    Eigen::Matrix4d others;
    others << all.block<2, 2>(0, 0), all.block<2, 2>(0, 4), all.block<2, 2>(4, 0),
        all.block<2, 2>(4, 4);
    Eigen::Matrix<double, 2, 4> between;
    between << all.block<2, 2>(2, 0), all.block<2, 2>(2, 4);
    const Eigen::Matrix2d explained = between * others.ldlt().solve(between.transpose());
    return (all.block<2, 2>(2, 2) - explained).cast<float>();
  }

  // No direction is known better than to min_sigma.
  Eigen::Matrix2f limited(const Eigen::Matrix2f& information) const {
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix2f> eigen;
    eigen.computeDirect(information);
    const float most = 1 / (options_.min_sigma * options_.min_sigma);
    return eigen.eigenvectors() * eigen.eigenvalues().cwiseMin(most).asDiagonal() *
           eigen.eigenvectors().transpose();
  }

  const ReferencePatch& patch_;
  const cv::Mat& image_;
  const SlantedWarp& warp_;
  const Slant& before_;
  const SlantOptions& options_;
};

}  // namespace

std::optional<Slant> update_slant(const ReferencePatch& patch, const cv::Mat& image,
                                  const Eigen::Vector2f& place, const SlantedWarp& warp,
                                  const Slant& before, const SlantOptions& options) {
  const float leverage = static_cast<float>(options.half_window) *
                         std::max(warp.per_slant[0].norm(), warp.per_slant[1].norm());
  if (!(leverage >= options.min_leverage)) return std::nullopt;
  return SlantAlignment(patch, image, warp, before, options).run(place);
}

}  // namespace rover
