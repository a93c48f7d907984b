#pragma once

#include "rover/optimization/bundle_pass.h"

namespace rover {

// One pass with Ceres: sparse (or, for few poses, dense) Schur complement of the points. For large
// problems, whose reduced system is sparse, and as the reference of SchurSolver's tests.
MinimizationResult minimize_with_ceres(BundleProblem& problem, const BundlePass& pass);

}  // namespace rover
