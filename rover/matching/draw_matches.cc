#include "rover/matching/draw_matches.h"

#include <algorithm>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace rover {
namespace {

// Positions are drawn to a sixteenth of a pixel.
constexpr int kShift = 4;

cv::Point fixed_point(const Eigen::Vector2f& position, int offset) {
  const Eigen::Vector2f scaled = position * (1 << kShift);
  return {cvRound(scaled.x()) + (offset << kShift), cvRound(scaled.y())};
}

cv::Scalar colour_of(float score) {
  const double s = std::clamp(static_cast<double>(score), 0.0, 1.0);
  return {0, 255 * std::min(1.0, 2 * s), 255 * std::min(1.0, 2 - 2 * s)};
}

void draw_feature(cv::Mat& canvas, cv::Point at, const cv::Scalar& colour) {
  cv::circle(canvas, at, 3 << kShift, colour, 1, cv::LINE_AA, kShift);
}

}  // namespace

cv::Mat draw_matches(const cv::Mat& image_a, const FeatureSet& a, const cv::Mat& image_b,
                     const FeatureSet& b, std::span<const Match> matches) {
  cv::Mat canvas(std::max(image_a.rows, image_b.rows), image_a.cols + image_b.cols, CV_8UC3,
                 cv::Scalar::all(0));
  cv::Mat left = canvas(cv::Rect(0, 0, image_a.cols, image_a.rows));
  cv::Mat right = canvas(cv::Rect(image_a.cols, 0, image_b.cols, image_b.rows));
  cv::cvtColor(image_a, left, cv::COLOR_GRAY2BGR);
  cv::cvtColor(image_b, right, cv::COLOR_GRAY2BGR);
  const cv::Scalar gray = cv::Scalar::all(150);
  for (const auto& position : a.positions) draw_feature(canvas, fixed_point(position, 0), gray);
  for (const auto& position : b.positions) {
    draw_feature(canvas, fixed_point(position, image_a.cols), gray);
  }
  // The surest last, so that they lie on top.
  std::vector<Match> ordered(matches.begin(), matches.end());
  std::stable_sort(ordered.begin(), ordered.end(),
                   [](const Match& m, const Match& n) { return m.score < n.score; });
  for (const Match& match : ordered) {
    const cv::Point from = fixed_point(a.positions[match.a], 0);
    const cv::Point to = fixed_point(b.positions[match.b], image_a.cols);
    const cv::Scalar colour = colour_of(match.score);
    draw_feature(canvas, from, colour);
    draw_feature(canvas, to, colour);
    cv::line(canvas, from, to, colour, 1, cv::LINE_AA, kShift);
  }
  return canvas;
}

}  // namespace rover
