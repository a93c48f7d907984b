// What the error of a finished inertial map is made of. The map is adjusted as at the end of a run;
// then, around the true poses of its keyframes, how much of that error the inertial data make, and
// how much what is seen, by linear response. For comparison, what is seen with its residuals turned
// around at random: each by itself (white noise of the same size), all of a landmark together, all
// of a keyframe together. Where these agree, the error is noise.
//
//   rover_map_error_bench SEQUENCE [--mode stereo-inertial]
//
// Prints a Markdown row for each: the error of the keyframes' positions, mm rms after SE(3)
// alignment.

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "bench/command_line.h"
#include "bench/finished_map.h"
#include "rover/base/random.h"
#include "rover/evaluation/live_judgement.h"
#include "rover/geometry/alignment.h"
#include "rover/optimization/inertial_map_adjustment.h"
#include "rover/optimization/inertial_model.h"
#include "rover/optimization/robust_kernel.h"

namespace rover {
namespace {

constexpr int kSamples = 6;

std::vector<Eigen::Vector3d> positions_of(const std::vector<SE3>& poses) {
  std::vector<Eigen::Vector3d> positions;
  for (const SE3& pose : poses) positions.push_back(pose.translation);
  return positions;
}

double rms_mm(const std::vector<SE3>& poses, const std::vector<SE3>& truth) {
  const auto aligned =
      align_points(positions_of(poses), positions_of(truth), AlignmentKind::kRigid);
  require(aligned.has_value(), "the keyframes are all in one place; use a longer sequence");
  return 1000 * aligned->rms;
}

// The true poses of keyframes, in the frame of the map. Where there is none (the first image may be
// a few ms older than the ground truth), the map's.
std::vector<SE3> true_poses(const Trajectory& reference, const Map& map,
                            const MapProblem& problem) {
  std::vector<SE3> result = problem.bundle.world_from_body;
  std::map<Timestamp, std::size_t> places;
  Trajectory estimate;
  for (std::size_t i = 0; i < result.size(); ++i) {
    estimate.push_back({map.at(problem.keyframes[i]).frame.time, result[i]});
    places[estimate.back().time] = i;
  }
  std::ranges::sort(estimate, {}, &StampedPose::time);
  const auto pairs = pair_with_interpolated(estimate, reference, 0.02);
  const auto aligned = align(pairs, AlignmentKind::kUpright);
  require(aligned.has_value(), "the keyframes are all in one place; use a longer sequence");
  for (const PosePair& pair : pairs)
    result[places.at(pair.time)] = move_pose(aligned->inverse(), pair.reference);
  return result;
}

class ErrorBudget {
 public:
  ErrorBudget(InertialBundleProblem problem, std::vector<SE3> truth, const BundleOptions& options)
      : problem_(std::move(problem)), truth_(std::move(truth)), options_(options) {
    options_.chi2 = std::numeric_limits<double>::max();
    fit_rest();
    active_.assign(problem_.bundle.observations.size(), 1);
  }

  enum class Cause { kAll, kInertial, kSeen };

  double of(Cause cause) const { return response(problem_, cause); }

  // Of some of the observations alone.
  template <class Choice>
  double of_seen(const Choice& choice) const {
    return response(scaled([&](std::size_t i) { return choice(i) ? 1.0 : 0.0; }), Cause::kSeen);
  }

  // Residuals turned around by a key: those with the same one together.
  template <class Key>
  double of_turned(const Key& key, double growth) const {
    double square = 0;
    for (int sample = 0; sample < kSamples; ++sample) {
      const auto factor = [&](std::size_t i) {
        const auto which = static_cast<std::uint64_t>(key(i));
        const bool negative = hash_seed(which, static_cast<std::uint64_t>(sample)) & 1;
        return negative ? -growth : growth;
      };
      square += std::pow(response(scaled(factor), Cause::kSeen), 2) / kSamples;
    }
    return std::sqrt(square);
  }

  const BundleProblem& bundle() const { return problem_.bundle; }

  // Fitted points take up part of what was noise.
  double noise_by_residual() const {
    const double residuals = 2 * static_cast<double>(active_.size());
    const double fitted = 3 * static_cast<double>(problem_.bundle.points.size());
    return std::sqrt(residuals / (residuals - fitted));
  }

 private:
  // Points, velocities and biases as they fit the true poses best.
  void fit_rest() {
    constexpr double kExact = 1e-6;  // m, rad
    InertialBundleProblem held = problem_;
    held.bundle.world_from_body = truth_;
    for (std::size_t i = 0; i < truth_.size(); ++i)
      held.priors.push_back({static_cast<int>(i), pose_prior(truth_[i], kExact, kExact)});
    const auto summary = adjust_inertial_bundle(held, {.bundle = options_});
    require(summary.visual.usable, "the map cannot be adjusted");
    problem_.bundle.world_from_body = truth_;
    problem_.bundle.points = held.bundle.points;
    problem_.velocity = held.velocity;
    problem_.bias = held.bias;
    freeze_weights();
  }

  // The kernel's weights as sigmas: they stay what they are whatever residuals become.
  void freeze_weights() {
    const HuberKernel kernel{std::exchange(options_.huber, std::numeric_limits<double>::max())};
    const Reprojector reprojector(problem_.bundle.rig);
    for (BundleObservation& seen : problem_.bundle.observations) {
      const BodyFrame body(truth_[static_cast<std::size_t>(seen.pose)]);
      const Eigen::Vector3d& point = problem_.bundle.points[static_cast<std::size_t>(seen.point)];
      Eigen::Vector2d residual = Eigen::Vector2d::Zero();  // and so it stays where it is not seen
      ObservedPoint(reprojector, body.from_world(point), false)
          .evaluate(seen.camera, seen.pixel, 1, residual, nullptr);
      expected_.push_back(seen.pixel - residual);
      const double weight = kernel.weight(residual.squaredNorm() / (seen.sigma * seen.sigma));
      if (weight > 0) seen.sigma /= std::sqrt(weight);
    }
  }

  // With residuals times a factor each.
  template <class Factor>
  InertialBundleProblem scaled(const Factor& factor) const {
    InertialBundleProblem result = problem_;
    for (std::size_t i = 0; i < active_.size(); ++i) {
      BundleObservation& seen = result.bundle.observations[i];
      seen.pixel = expected_[i] + factor(i) * (seen.pixel - expected_[i]);
    }
    return result;
  }

  double response(const InertialBundleProblem& problem, Cause cause) const {
    const ScaleGauge gauge;
    InertialBundleModel model(problem, {active_, gauge, options_, 0});
    const auto state = InertialBundleModel::initial(problem);
    InertialBundleModel::Equations equations;
    model.linearize(state, equations);
    if (cause == Cause::kInertial) {
      for (Vector6d& gradient : equations.visual.pose_gradient) gradient.setZero();
      for (Eigen::Vector3d& gradient : equations.visual.point_gradient) gradient.setZero();
    } else if (cause == Cause::kSeen) {
      equations.states.gradient.setZero();
    }
    InertialBundleModel::Step step;
    require(model.solve(equations, Damping(1e-12), step), "the map does not determine its states");
    auto moved = state;
    model.move(state, step, moved);
    return rms_mm(moved.bundle.world_from_body, truth_);
  }

  InertialBundleProblem problem_;
  std::vector<SE3> truth_;
  BundleOptions options_;
  std::vector<char> active_;
  std::vector<Eigen::Vector2d> expected_;  // px, of each observation
};

// What fits is kept, as at the end of a run.
void keep(InertialBundleProblem& problem, const std::vector<char>& inliers) {
  auto& observations = problem.bundle.observations;
  std::vector<BundleObservation> kept;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (inliers[i]) kept.push_back(observations[i]);
  }
  observations = std::move(kept);
}

void print(const ErrorBudget& budget, double error) {
  using Cause = ErrorBudget::Cause;
  const auto& seen = budget.bundle().observations;
  const double growth = budget.noise_by_residual();
  const auto each = [](std::size_t i) { return i; };
  const auto landmark = [&](std::size_t i) { return seen[i].point; };
  const auto keyframe = [&](std::size_t i) { return seen[i].pose; };
  const auto row = [](const char* what, double mm) {
    std::cout << fmt::format("| {} | {:.2f} |\n", what, mm);
  };
  std::cout << fmt::format("{} keyframes, {} landmarks, {} observations\n\n| | mm |\n|---|---|\n",
                           budget.bundle().world_from_body.size(), budget.bundle().points.size(),
                           seen.size());
  row("the map", error);
  row("linear response", budget.of(Cause::kAll));
  row("of inertial data", budget.of(Cause::kInertial));
  row("of what is seen", budget.of(Cause::kSeen));
  const auto is_disparity = [&](std::size_t i) { return seen[i].camera == kDisparity; };
  row("of disparities", budget.of_seen(is_disparity));
  row("of places", budget.of_seen([&](std::size_t i) { return !is_disparity(i); }));
  row("turned, each", budget.of_turned(each, growth));
  row("turned, by landmark", budget.of_turned(landmark, 1));
  row("turned, by keyframe", budget.of_turned(keyframe, 1));
}

void run(const std::string& path, const std::string& mode_name) {
  const Mode mode = parse_mode(mode_name);
  require(is_inertial(mode), "--mode {}: use mono-inertial or stereo-inertial", mode_name);
  DatasetOptions input;
  input.path = path;
  input.stereo = is_stereo(mode);
  input.inertial = true;
  const auto dataset = open_dataset(input);
  System system(Config(), dataset->rig(), mode, {}, dataset->imu_calibration());
  run_through(system, *dataset);
  const auto map = largest_map_of(system);
  require(map->inertial().aligned,
          "the map was not aligned to inertial data; use a longer sequence");
  const Config& config = system.config();
  InertialMapProblem problem =
      gather_newest(*map, config.max_finally_adjusted, config.mapping.creation.weighting);
  const auto summary =
      adjust_inertial_bundle(problem.inertial, {.bundle = config.final_adjustment});
  problem.map.bundle.world_from_body = problem.inertial.bundle.world_from_body;
  keep(problem.inertial, summary.visual.inliers);
  const std::vector<SE3> truth = true_poses(dataset->ground_truth(), *map, problem.map);
  const double error = rms_mm(problem.inertial.bundle.world_from_body, truth);
  print(ErrorBudget(std::move(problem.inertial), truth, config.final_adjustment), error);
}

}  // namespace
}  // namespace rover

int main(int argc, char** argv) {
  CLI::App program("What the error of a finished inertial map is made of");
  std::string path, mode = "stereo-inertial";
  program.add_option("sequence", path, "a folder of rover simulate")->required();
  program.add_option("--mode", mode, "mono-inertial or stereo-inertial")->capture_default_str();
  return rover::parse_and_run(program, argc, argv, [&] { rover::run(path, mode); });
}
