#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "rover/base/error.h"
#include "rover/base/random.h"

namespace rover {

struct RansacOptions {
  std::uint64_t seed = 0;      // the same seed and data give the same answer
  double confidence = 0.9999;  // of having drawn one sample without outliers
  int min_iterations = 20;     // noise makes some clean samples useless
  int max_iterations = 1000;

  // Throws InputError for values that make no sense.
  void check() const {
    require(confidence > 0 && confidence < 1, "RANSAC: confidence must lie between 0 and 1");
    require(min_iterations >= 1 && max_iterations >= min_iterations,
            "RANSAC: needs 1 <= min_iterations <= max_iterations");
  }
};

template <class Model>
struct RansacResult {
  Model model;
  std::vector<int> inliers;  // ascending indices
  double cost = 0;           // sum of the squared errors, each at most the threshold
  int iterations = 0;
};

// How many samples it takes to draw, with the given confidence, one of inliers only.
inline double ransac_iterations(double inlier_share, int sample_size, double confidence) {
  const double clean = std::pow(inlier_share, sample_size);
  if (clean <= 0) return std::numeric_limits<double>::infinity();
  if (clean >= 1) return 1;
  return std::log(1 - confidence) / std::log1p(-clean);
}

// `Size` different indices below `count`, which must be at least `Size`.
template <int Size>
std::array<int, Size> draw_sample(int count, Random& random) {
  std::array<int, Size> sample;
  for (int i = 0; i < Size;) {
    sample[i] = random.index(count);
    if (std::find(sample.begin(), sample.begin() + i, sample[i]) == sample.begin() + i) ++i;
  }
  return sample;
}

// RANSAC with the truncated quadratic cost of MSAC (Torr and Zisserman, "MLESAC", 2000) and local
// optimisation of each new best model (Chum, Matas, Kittler, "Locally optimized RANSAC", 2003).
// The problem says what is estimated:
//   using Model; static constexpr int kSampleSize;
//   int size() const;                                       number of data
//   std::array<int, kSampleSize> sample(Random&) const;     data for one minimal solution
//   std::vector<Model> solve(sample) const;
//   double squared_error(const Model&, int) const;          of one datum
//   double threshold() const;                               inliers have a squared error below it
//   Model refine(const Model&, const std::vector<int>& inliers) const;
// Nothing if no sample has a solution. The caller makes sure that samples can be drawn.
template <class Problem>
class Ransac {
 public:
  using Model = typename Problem::Model;
  using Result = RansacResult<Model>;

  Ransac(const Problem& problem, const RansacOptions& options)
      : problem_(problem), options_(options) {}

  std::optional<Result> run() {
    Random random(options_.seed);
    double needed = options_.max_iterations;
    int iteration = 0;
    while (iteration < options_.min_iterations || iteration < needed) {
      if (++iteration > options_.max_iterations) break;
      bool better = false;
      for (const Model& model : problem_.solve(problem_.sample(random)))
        better = consider(model) || better;
      if (better) needed = iterations_for_best();
    }
    if (best_) best_->iterations = std::min(iteration, options_.max_iterations);
    return best_;
  }

 private:
  double iterations_for_best() const {
    const double share = static_cast<double>(best_->inliers.size()) / problem_.size();
    return ransac_iterations(share, Problem::kSampleSize, options_.confidence);
  }

  double best_cost() const { return best_ ? best_->cost : std::numeric_limits<double>::infinity(); }

  // The model with its inliers, or nothing if it is no better than the best so far.
  std::optional<Result> score(const Model& model) const {
    Result result{model, {}, 0, 0};
    const double limit = best_cost();
    for (int i = 0; i < problem_.size(); ++i) {
      const double error = problem_.squared_error(model, i);
      const bool inlier = error < problem_.threshold();  // false for what is not a number
      if (inlier) result.inliers.push_back(i);
      result.cost += inlier ? error : problem_.threshold();
      if (!(result.cost < limit)) return std::nullopt;
    }
    return result;
  }

  bool consider(const Model& model) {
    const auto scored = score(model);
    if (!scored) return false;
    best_ = scored;
    optimise_best();
    return true;
  }

  // A model of a minimal sample is so noisy that it misses many inliers: a wider bound first takes
  // them in, then narrows.
  void optimise_best() {
    Model model = best_->model;
    for (const double widening : {9.0, 4.0, 1.0, 1.0}) {
      const std::vector<int> inliers = inliers_of(model, widening * problem_.threshold());
      if (static_cast<int>(inliers.size()) <= Problem::kSampleSize) return;
      model = problem_.refine(model, inliers);
      if (const auto refined = score(model)) best_ = refined;
    }
  }

  std::vector<int> inliers_of(const Model& model, double threshold) const {
    std::vector<int> inliers;
    for (int i = 0; i < problem_.size(); ++i)
      if (problem_.squared_error(model, i) < threshold) inliers.push_back(i);
    return inliers;
  }

  const Problem& problem_;
  const RansacOptions& options_;
  std::optional<Result> best_;
};

template <class Problem>
std::optional<RansacResult<typename Problem::Model>> ransac(const Problem& problem,
                                                            const RansacOptions& options) {
  return Ransac<Problem>(problem, options).run();
}

}  // namespace rover
