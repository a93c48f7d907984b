#pragma once

#include <functional>
#include <vector>

#include "rover/optimization/bundle_adjustment.h"
#include "rover/optimization/levenberg_marquardt.h"
#include "rover/optimization/scale_gauge.h"

namespace rover {

// One minimisation over the active observations: what the solvers are asked for.
struct BundlePass {
  const std::vector<char>& active;  // per observation
  const ScaleGauge& gauge;
  const BundleOptions& options;
  int max_iterations = 0;

  MinimizationLimits limits() const {
    return {.iterations = max_iterations,
            .relative_decrease = options.min_relative_decrease,
            .should_stop = options.should_stop};
  }
};

// Throws std::invalid_argument for indices out of range and weights that make no sense.
void check_indices(const BundleProblem& problem);

// Both passes of an adjustment, which differ in the observations that take part: all with the
// robust kernel, then those that fit. Fills the summary; the problem is as before where that is not
// usable. `minimize` does one pass, over what else it may have to estimate, too.
BundleSummary adjust_in_two_passes(
    BundleProblem& problem, const BundleOptions& options,
    const std::function<MinimizationResult(const BundlePass&)>& minimize);

}  // namespace rover
