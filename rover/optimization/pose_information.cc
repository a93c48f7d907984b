#include "rover/optimization/pose_information.h"

#include "rover/optimization/schur_complement.h"

namespace rover {

Eigen::MatrixXd pose_information(const BundleProblem& problem, const std::vector<char>& active,
                                 const BundleOptions& options) {
  check_indices(problem);
  const ScaleGauge gauge;  // holds nothing
  const BundleStructure structure(problem, active);
  const BundleLinearizer linearizer(problem, structure, {active, gauge, options, 0});
  BundleEquations visual;
  linearizer.linearize({problem.world_from_body, problem.points}, visual);
  DenseEquations nothing_else;
  nothing_else.reset(static_cast<int>(6 * structure.free_poses.size()));
  return SchurComplement(structure).information(visual, nothing_else);
}

}  // namespace rover
