#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "rover/base/thread_pool.h"
#include "rover/features/kernels.h"

namespace rover {

// A map of scores, one per pixel of the image; stride in floats.
struct ScoreMap {
  const float* data;
  int stride, width, height;

  const float* at(int x, int y) const { return data + static_cast<std::ptrdiff_t>(y) * stride + x; }
};

// A local maximum of a score map, at a whole pixel.
struct Candidate {
  int x, y;
  float score;
  int index = -1;  // free for those who choose among things of their own
};

struct MaximaOptions {
  int radius = 4;   // largest of the (2 radius + 1)^2 window around it
  int border = 6;   // px from the image's edge without maxima
  float floor = 0;  // scores above this only

  void check() const;
};

// All local maxima in raster order. Among equal scores in one window (a plateau) each is returned;
// select_candidates() keeps the first. `mask` (may be null): none where it is 0. `scratch` is grown
// as needed and may be kept between calls.
std::vector<Candidate> find_local_maxima(const ScoreMap& map, const MaximaOptions& options,
                                         const cv::Mat* mask, const kernels::Kernels& kernels,
                                         ThreadPool& pool, std::vector<float>& scratch);

// Offset of the vertex of the parabola through three values at -1, 0, 1; in [-0.5, 0.5] if the
// middle one is largest, 0 if all are equal.
inline float parabola_offset(float before, float at, float after) {
  const float curvature = before - 2 * at + after;
  return curvature < 0 ? 0.5f * (before - after) / curvature : 0;
}

// Sub-pixel position of a maximum: vertex of the quadratic surface that fits the 3x3 scores around
// it best (least squares), which averages noise that a parabola in x and one in y would follow; the
// whole pixel where the surface has no maximum within a pixel.
Eigen::Vector2f refine_quadratic(const ScoreMap& map, const Candidate& candidate);

// Sub-pixel position of a maximum: one parabola in x, one in y.
Eigen::Vector2f refine_parabola(const ScoreMap& map, const Candidate& candidate);

}  // namespace rover
