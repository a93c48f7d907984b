#pragma once

#include <vector>

#include "rover/optimization/bundle_adjustment.h"
#include "rover/optimization/scale_gauge.h"

namespace rover {

// One minimisation over the active observations: what both solvers are asked for and answer.
struct BundlePass {
  const std::vector<char>& active;  // per observation
  const ScaleGauge& gauge;
  const BundleOptions& options;
  int max_iterations = 0;
};

struct BundlePassResult {
  int iterations = 0;
  bool usable = false;   // false: the solver failed; the problem may have changed
  bool stopped = false;  // by options.should_stop
};

}  // namespace rover
