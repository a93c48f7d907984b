#include "rover/features/local_maxima.h"

#include "rover/base/error.h"

namespace rover {
namespace {

// One stripe of rows: the maxima of its rows' windows against those of the rows around.
class StripeSearch {
 public:
  StripeSearch(const ScoreMap& map, const MaximaOptions& options, const cv::Mat* mask,
               const kernels::Kernels& kernels, const float* row_maxima)
      : map_(map),
        options_(options),
        mask_(mask),
        kernels_(kernels),
        row_maxima_(row_maxima),
        found_(static_cast<std::size_t>(map.width)),
        scratch_(2 * static_cast<std::size_t>(map.width) + 2) {}

  void search_row(int y, std::vector<Candidate>& candidates) {
    rows_.clear();
    for (int k = std::max(0, y - options_.radius);
         k <= std::min(map_.height - 1, y + options_.radius); ++k) {
      rows_.push_back(row_maxima_ + static_cast<std::ptrdiff_t>(k) * map_.width);
    }
    const float* row = map_.at(0, y);
    const int count =
        kernels_.find_maxima(row, rows_.data(), static_cast<int>(rows_.size()), map_.width,
                             options_.floor, found_.data(), scratch_.data());
    for (int i = 0; i < count; ++i) {
      const int x = found_[i];
      if (wanted(x, y)) candidates.push_back({x, y, row[x]});
    }
  }

 private:
  bool wanted(int x, int y) const {
    return x >= options_.border && x < map_.width - options_.border &&
           (!mask_ || mask_->at<std::uint8_t>(y, x) != 0);
  }

  const ScoreMap& map_;
  const MaximaOptions& options_;
  const cv::Mat* mask_;
  const kernels::Kernels& kernels_;
  const float* row_maxima_;
  std::vector<const float*> rows_;
  std::vector<int> found_;
  std::vector<float> scratch_;
};

void fill_row_maxima(const ScoreMap& map, int radius, const kernels::Kernels& kernels,
                     ThreadPool& pool, float* out) {
  pool.parallel_for(static_cast<std::size_t>(map.height), [&](std::size_t begin, std::size_t end) {
    std::vector<float> scratch(2 * (static_cast<std::size_t>(map.width) + 2 * radius));
    for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      kernels.row_maximum(map.at(0, y), map.width, radius,
                          out + static_cast<std::ptrdiff_t>(y) * map.width, scratch.data());
    }
  });
}

}  // namespace

void MaximaOptions::check() const {
  require(radius >= 1 && radius <= 32, "non-maximum suppression: radius must be 1 to 32, not {}",
          radius);
  require(border >= 1, "non-maximum suppression: border must be at least 1, not {}", border);
}

std::vector<Candidate> find_local_maxima(const ScoreMap& map, const MaximaOptions& options,
                                         const cv::Mat* mask, const kernels::Kernels& kernels,
                                         ThreadPool& pool, std::vector<float>& scratch) {
  scratch.resize(static_cast<std::size_t>(map.width) * map.height);
  fill_row_maxima(map, options.radius, kernels, pool, scratch.data());
  // Each row has its own list, so that the order does not depend on the stripes.
  const int rows = std::max(0, map.height - 2 * options.border);
  std::vector<std::vector<Candidate>> found(static_cast<std::size_t>(rows));
  pool.parallel_for(found.size(), [&](std::size_t begin, std::size_t end) {
    StripeSearch stripe(map, options, mask, kernels, scratch.data());
    for (std::size_t i = begin; i < end; ++i) {
      stripe.search_row(options.border + static_cast<int>(i), found[i]);
    }
  });
  std::vector<Candidate> candidates;
  for (const auto& row : found) candidates.insert(candidates.end(), row.begin(), row.end());
  return candidates;
}

Eigen::Vector2f refine_parabola(const ScoreMap& map, const Candidate& candidate) {
  const float* at = map.at(candidate.x, candidate.y);
  return {
      static_cast<float>(candidate.x) + parabola_offset(at[-1], at[0], at[1]),
      static_cast<float>(candidate.y) + parabola_offset(at[-map.stride], at[0], at[map.stride])};
}

Eigen::Vector2f refine_quadratic(const ScoreMap& map, const Candidate& candidate) {
  const float* above = map.at(candidate.x, candidate.y - 1);
  const float* at = above + map.stride;
  const float* below = at + map.stride;
  // Derivatives of the surface at the centre, in closed form (the grid is orthogonal).
  const auto column = [&](int i) { return above[i] + at[i] + below[i]; };
  const auto row = [](const float* values) { return values[-1] + values[0] + values[1]; };
  const float gx = (column(1) - column(-1)) / 6, gy = (row(below) - row(above)) / 6;
  const float xx = (column(1) - 2 * column(0) + column(-1)) / 3;
  const float yy = (row(below) - 2 * row(at) + row(above)) / 3;
  const float xy = (above[-1] + below[1] - above[1] - below[-1]) / 4;
  const float determinant = xx * yy - xy * xy;
  const Eigen::Vector2f whole(static_cast<float>(candidate.x), static_cast<float>(candidate.y));
  if (!(determinant > 0)) return whole;
  const Eigen::Vector2f offset((xy * gy - yy * gx) / determinant,
                               (xy * gx - xx * gy) / determinant);
  return offset.cwiseAbs().maxCoeff() <= 1 ? Eigen::Vector2f(whole + offset) : whole;
}

}  // namespace rover
