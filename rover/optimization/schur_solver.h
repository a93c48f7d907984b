#pragma once

#include "rover/optimization/bundle_pass.h"

namespace rover {

// One pass with our own Levenberg-Marquardt, made for windows of a map (up to some hundred poses):
// per iteration one sweep over the observations builds the block normal equations, the points are
// eliminated into a dense reduced system of the free poses (Schur complement: Triggs et al.,
// "Bundle adjustment - a modern synthesis", 2000, section 6.1), and that is solved by Cholesky
// factorisation. One thread, fixed order of all sums: the result is the same to the byte.
MinimizationResult minimize_with_schur(BundleProblem& problem, const BundlePass& pass);

}  // namespace rover
