#pragma once

#include "rover/optimization/bundle_adjustment.h"

namespace rover {

// What the observations that are `active` say about all free poses, the points being unknown:
// the information matrix in the tangents of the poses, in their order (6 each). Free directions
// (the scale of a monocular problem) have none. An empty matrix where a point is not observed.
Eigen::MatrixXd pose_information(const BundleProblem& problem, const std::vector<char>& active,
                                 const BundleOptions& options);

}  // namespace rover
