#include "rover/optimization/bundle_equations.h"

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include "rover/optimization/simulated_bundle.h"

namespace rover {
namespace {

// The blocks as one matrix: free poses first, then tracks.
Eigen::MatrixXd dense_hessian(const BundleStructure& structure, const BundleEquations& equations) {
  const Eigen::Index poses = 6 * structure.free_poses.size();
  const Eigen::Index size = poses + 3 * structure.tracks.size();
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t s = 0; s < structure.free_poses.size(); ++s)
    result.block<6, 6>(6 * s, 6 * s) = equations.pose_hessian[s];
  for (std::size_t t = 0; t < structure.tracks.size(); ++t) {
    const Eigen::Index column = poses + 3 * t;
    result.block<3, 3>(column, column) = equations.point_hessian[t];
    for (int e = structure.tracks[t].begin; e < structure.tracks[t].end; ++e) {
      const int slot = structure.edges[e].slot;
      if (slot < 0) continue;
      result.block<6, 3>(6 * slot, column) += equations.cross[e];
      result.block<3, 6>(column, 6 * slot) += equations.cross[e].transpose();
    }
  }
  return result;
}

Eigen::VectorXd dense_gradient(const BundleStructure& structure, const BundleEquations& equations) {
  const Eigen::Index poses = 6 * structure.free_poses.size();
  Eigen::VectorXd result(poses + 3 * structure.tracks.size());
  for (std::size_t s = 0; s < structure.free_poses.size(); ++s)
    result.segment<6>(6 * s) = equations.pose_gradient[s];
  for (std::size_t t = 0; t < structure.tracks.size(); ++t)
    result.segment<3>(poses + 3 * t) = equations.point_gradient[t];
  return result;
}

struct Linearized {
  explicit Linearized(BundleProblem p, bool fix_scale = false)
      : problem(std::move(p)),
        options{.fix_scale = fix_scale},
        gauge(ScaleGauge::of(problem, options)),
        active(problem.observations.size(), 1),
        structure(problem, active),
        linearizer(problem, structure, {active, gauge, options, 1}) {
    linearizer.linearize({problem.world_from_body, problem.points}, equations);
  }

  // The number of directions that change no residual.
  int free_directions() const {
    Eigen::MatrixXd hessian = dense_hessian(structure, equations);
    const Eigen::VectorXd scale = hessian.diagonal().cwiseSqrt().cwiseInverse();
    hessian = scale.asDiagonal() * hessian * scale.asDiagonal();
    const Eigen::VectorXd values =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(hessian, Eigen::EigenvaluesOnly)
            .eigenvalues();
    return static_cast<int>((values.array() < 1e-9).count());
  }

  BundleProblem problem;
  BundleOptions options;
  ScaleGauge gauge;
  std::vector<char> active;
  BundleStructure structure;
  BundleLinearizer linearizer;
  BundleEquations equations;
};

// Noise-free at the true values: only there is the Hessian blind to exactly the gauge.
BundleProblem exact_problem(int cameras, int fixed) {
  BundleSimulation simulation{.rig = simulated_rig(simulated_pinhole(), cameras),
                              .fixed_poses = fixed,
                              .free_poses = 5 - fixed,
                              .points = 60,
                              .sigma = 0};
  // In mono the body is the camera: with a lever arm, rotation would show the scale.
  if (cameras == 1) simulation.rig.body_from_camera[0] = SE3();
  return simulate_bundle(simulation).truth;
}

TEST(BundleEquations, FreeDirectionsAreThoseOfTheGauge) {
  EXPECT_EQ(Linearized(exact_problem(1, 0)).free_directions(), 7);
  EXPECT_EQ(Linearized(exact_problem(2, 0)).free_directions(), 6);
  EXPECT_EQ(Linearized(exact_problem(1, 1)).free_directions(), 1);
  EXPECT_EQ(Linearized(exact_problem(2, 1)).free_directions(), 0);
  EXPECT_EQ(Linearized(exact_problem(1, 1), true).free_directions(), 0);
}

TEST(BundleEquations, HoldingTheScaleLeavesNoGradientAlongTheRadius) {
  const BundleSimulation simulation{.fixed_poses = 1};
  const Linearized held(simulate_bundle(simulation).problem, true);
  ASSERT_GE(held.gauge.pose, 1);
  const Vector6d n = held.gauge.held_direction(held.problem.world_from_body[held.gauge.pose]);
  EXPECT_NEAR(n.dot(held.equations.pose_gradient[held.gauge.pose - 1]), 0, 1e-7);
  const Linearized loose(simulate_bundle(simulation).problem, false);
  EXPECT_GT(std::abs(n.dot(loose.equations.pose_gradient[held.gauge.pose - 1])), 1);
}

TEST(BundleEquations, GradientIsTheDerivativeOfTheRobustCost) {
  const Linearized bundle(
      simulate_bundle({.rig = simulated_rig(simulated_fisheye(), 2), .points = 40, .outliers = 0.1})
          .problem);
  const BundleState state{bundle.problem.world_from_body, bundle.problem.points};
  const Eigen::VectorXd gradient = dense_gradient(bundle.structure, bundle.equations);
  const auto cost_at = [&](Eigen::Index unknown, double h) {
    BundleState moved = state;
    const Eigen::Index poses = 6 * bundle.structure.free_poses.size();
    if (unknown < poses) {
      SE3& pose = moved.world_from_body[bundle.structure.free_poses[unknown / 6]];
      pose = se3_plus(pose, h * Vector6d::Unit(unknown % 6));
    } else {
      const int point = bundle.structure.tracks[(unknown - poses) / 3].point;
      moved.points[point][(unknown - poses) % 3] += h;
    }
    BundleEquations equations;
    bundle.linearizer.linearize(moved, equations);
    return equations.cost;
  };
  const double h = 1e-6;
  for (Eigen::Index k = 0; k < gradient.size(); ++k) {
    const double numeric = (cost_at(k, h) - cost_at(k, -h)) / (2 * h);
    EXPECT_NEAR(gradient[k], numeric, 1e-4 * (1 + std::abs(gradient[k]))) << k;
  }
}

TEST(BundleEquations, StructureSortsObservationsByPointAndPose) {
  BundleProblem problem = exact_problem(2, 1);
  Random random(3);
  for (std::size_t i = problem.observations.size(); i > 1; --i)
    std::swap(problem.observations[i - 1], problem.observations[random.index(static_cast<int>(i))]);
  std::vector<char> active(problem.observations.size(), 1);
  active[5] = active[17] = 0;
  const BundleStructure structure(problem, active);
  EXPECT_EQ(structure.observations.size(), active.size() - 2);
  std::size_t edges = 0;
  int observations = 0, point = -1;
  for (const BundleTrack& track : structure.tracks) {
    EXPECT_GT(track.point, point);
    EXPECT_LE(track.end - track.begin, structure.longest_track);
    point = track.point;
    int pose = -1;
    for (int e = track.begin; e < track.end; ++e, ++edges) {
      const BundleEdge& edge = structure.edges[e];
      EXPECT_GT(edge.pose, pose);
      EXPECT_EQ(edge.slot, edge.pose - 1);
      EXPECT_EQ(edge.begin, observations);
      pose = edge.pose;
      for (; observations < edge.end; ++observations) {
        EXPECT_EQ(structure.observations[observations].pose, pose);
        EXPECT_EQ(structure.observations[observations].point, point);
      }
    }
  }
  EXPECT_EQ(edges, structure.edges.size());
}

}  // namespace
}  // namespace rover
