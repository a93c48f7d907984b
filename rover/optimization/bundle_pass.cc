#include "rover/optimization/bundle_pass.h"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "rover/base/quantile.h"
#include "rover/optimization/reprojection.h"
#include "rover/optimization/robust_kernel.h"

namespace rover {
namespace {

// No camera sees what is nearer than this share of the median distance. A wrong match can pull its
// point into the centre of a camera, where it fits whatever was seen, and from then on holds the
// camera: it cannot move without throwing the point behind it or out of its view.
constexpr double kNearest = 0.02;

// How the observations fit, each.
struct Fits {
  std::vector<double> chi2;      // squared residuals in sigmas; kUnseenChi2 where nothing is seen
  std::vector<char> far_enough;  // to be seen
};

Fits fits_of(const BundleProblem& problem) {
  const Reprojector reprojector(problem.rig);
  const std::vector<BodyFrame> frames(problem.world_from_body.begin(),
                                      problem.world_from_body.end());
  Fits fits;
  std::vector<double> distances;
  fits.chi2.reserve(problem.observations.size());
  distances.reserve(problem.observations.size());
  std::optional<ObservedPoint> observed;
  const BundleObservation* last = nullptr;
  for (const BundleObservation& seen : problem.observations) {
    const Eigen::Vector3d point = frames[seen.pose].from_world(problem.points[seen.point]);
    if (!last || seen.pose != last->pose || seen.point != last->point) {
      observed.emplace(reprojector, point, false);
    }
    last = &seen;
    fits.chi2.push_back(observed->chi2(seen.camera, seen.pixel, seen.sigma));
    const int camera = seen.camera == kDisparity ? 0 : seen.camera;
    distances.push_back((point - problem.rig.body_from_camera[camera].translation).norm());
  }
  const double nearest = kNearest * median(distances);
  for (std::size_t i = 0; i < distances.size(); ++i) {
    fits.far_enough.push_back(distances[i] >= nearest);
    if (distances[i] < nearest) fits.chi2[i] = kUnseenChi2;
  }
  return fits;
}

double robust_cost(const std::vector<double>& chi2, const BundleOptions& options) {
  const HuberKernel kernel{options.huber};
  double cost = 0;
  for (const double s : chi2) cost += 0.5 * kernel.rho(s);
  return cost;
}

std::vector<char> within(const std::vector<double>& chi2, double limit) {
  std::vector<char> result(chi2.size());
  std::transform(chi2.begin(), chi2.end(), result.begin(), [&](double s) { return s <= limit; });
  return result;
}

bool all_finite(const BundleProblem& problem) {
  const auto is_finite = [](const auto& values) { return values.allFinite(); };
  return std::all_of(problem.points.begin(), problem.points.end(), is_finite) &&
         std::all_of(problem.world_from_body.begin(), problem.world_from_body.end(),
                     [&](const SE3& pose) {
                       return is_finite(pose.translation) && is_finite(pose.rotation.coeffs());
                     });
}

// Both passes; whether the result can be used.
bool minimize_twice(const BundleProblem& problem, const BundleOptions& options,
                    const std::function<MinimizationResult(const BundlePass&)>& minimize,
                    BundleSummary& summary) {
  const ScaleGauge gauge = ScaleGauge::of(problem, options);
  const MinimizationResult first =
      minimize({summary.inliers, gauge, options, options.first_iterations});
  summary.iterations = first.iterations;
  if (!first.usable || first.stopped || options.second_iterations == 0) return first.usable;
  summary.inliers = within(fits_of(problem).chi2, options.chi2);
  const MinimizationResult second =
      minimize({summary.inliers, gauge, options, options.second_iterations});
  summary.iterations += second.iterations;
  return second.usable;
}

}  // namespace

void check_indices(const BundleProblem& problem) {
  const auto valid = [](int index, std::size_t size) {
    return index >= 0 && static_cast<std::size_t>(index) < size;
  };
  if (problem.pose_fixed.size() != problem.world_from_body.size())
    throw std::invalid_argument("bundle adjustment: pose_fixed and world_from_body differ in size");
  for (const BundleObservation& seen : problem.observations) {
    if (!valid(seen.pose, problem.world_from_body.size()) ||
        !valid(seen.point, problem.points.size()) ||
        !(seen.camera == kDisparity ? problem.rig.size() > 1
                                    : valid(seen.camera, problem.rig.cameras.size())))
      throw std::invalid_argument("bundle adjustment: an observation's index is out of range");
    if (!(seen.sigma > 0))
      throw std::invalid_argument("bundle adjustment: an observation's sigma is not positive");
  }
}

BundleSummary adjust_in_two_passes(
    BundleProblem& problem, const BundleOptions& options,
    const std::function<MinimizationResult(const BundlePass&)>& minimize) {
  BundleSummary summary;
  if (problem.observations.empty()) return summary;
  const auto initial_poses = problem.world_from_body;
  const auto initial_points = problem.points;
  // Behind a camera a point may come back before it; in its centre it would stay.
  const Fits initial = fits_of(problem);
  summary.inliers = initial.far_enough;
  summary.initial_cost = robust_cost(initial.chi2, options);
  summary.usable = all_finite(problem) && minimize_twice(problem, options, minimize, summary);
  if (!summary.usable) {
    problem.world_from_body = initial_poses;
    problem.points = initial_points;
  }
  const std::vector<double> chi2 = fits_of(problem).chi2;
  summary.final_cost = robust_cost(chi2, options);
  summary.inliers = within(chi2, options.chi2);
  return summary;
}

}  // namespace rover
