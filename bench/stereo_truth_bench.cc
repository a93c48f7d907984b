// How far stereo partners are from where the right camera really sees what the left one does, by
// tracing rays through the scene that `rover simulate` rendered (without --along). Prints one
// Markdown row per class of partners:
//
//   rover simulate --scene room --texture low --rate 2 --output DIR
//   rover_stereo_truth_bench DIR --scene room --texture low
//
//   aligned    photometrically, by the sigma that is stated; else by whether the default options
//              keep it
//   wrong      share that is more than 1 px and 5 sigmas off along the epipolar line
//   rms        px, of the others; stated: the root mean square of their sigmas
//   bias       px, of the others' median: above 0 is too near

#include <CLI/CLI.hpp>

#include <cmath>
#include <iostream>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "bench/command_line.h"
#include "rover/base/error.h"
#include "rover/base/quantile.h"
#include "rover/base/thread_pool.h"
#include "rover/datasets/dataset.h"
#include "rover/datasets/trajectory.h"
#include "rover/matching/feature_family.h"
#include "rover/matching/stereo_matching.h"
#include "rover/simulation/scene_factory.h"
#include "rover/simulation/scene_rays.h"

namespace rover {
namespace {

struct Options {
  std::string sequence, scene = "room", texture = "rich", family = "xfeat-corner";
  std::uint64_t scene_seed = 1;
  int threads = 2;
};

struct Tally {
  int wrong = 0;
  double squares = 0, stated = 0;
  std::vector<double> errors;  // px, of those that are not wrong

  void add(double error, double sigma) {
    if (std::abs(error) > std::max(1.0, 5 * sigma)) {
      ++wrong;
      return;
    }
    errors.push_back(error);
    squares += error * error;
    stated += sigma * sigma;
  }
};

// The distance along a ray to what it hits, in multiples of the direction.
std::optional<double> trace(const SceneRays& rays, const Eigen::Vector3d& origin,
                            const Eigen::Vector3d& direction) {
  SceneRays::Packet packet;
  packet.ox.fill(static_cast<float>(origin.x()));
  packet.oy.fill(static_cast<float>(origin.y()));
  packet.oz.fill(static_cast<float>(origin.z()));
  packet.dx.fill(static_cast<float>(direction.x()));
  packet.dy.fill(static_cast<float>(direction.y()));
  packet.dz.fill(static_cast<float>(direction.z()));
  rays.trace(packet);
  if (packet.patch[0] < 0) return std::nullopt;
  return packet.distance[0];
}

// What the cameras of a simulated sequence really see.
class Truth {
 public:
  Truth(const Scene& scene, const Rig& rig, const Trajectory& poses)
      : rays_(scene.patches),
        rig_(rig),
        poses_(poses),
        right_from_left_(rig.body_from_camera[1].inverse() * rig.body_from_camera[0]) {}

  SE3 world_from_left(Timestamp time) const {
    const auto at = std::ranges::lower_bound(poses_, time, {}, &StampedPose::time);
    require(at != poses_.end() && at->time == time,
            "the ground truth has no pose at {}; use a sequence of rover simulate", time);
    return at->pose * rig_.body_from_camera[0];
  }

  // How far a right position is towards the near end of the epipolar line, px.
  std::optional<double> error_of(const StereoMatch& match, const FeatureSet& left,
                                 const SE3& world_from_left) const {
    const auto ray = rig_.cameras[0].unproject(left.positions[match.left].cast<double>());
    if (!ray) return std::nullopt;
    const auto distance =
        trace(rays_, world_from_left.translation, world_from_left.rotation * *ray);
    if (!distance) return std::nullopt;
    const Eigen::Vector3d point = *distance * *ray;
    const auto seen = rig_.cameras[1].project(right_from_left_ * point);
    const auto at_infinity = rig_.cameras[1].project(right_from_left_.rotation * point);
    if (!seen || !at_infinity) return std::nullopt;
    return (match.position.cast<double>() - *seen).dot((*seen - *at_infinity).normalized());
  }

 private:
  SceneRays rays_;
  const Rig& rig_;
  const Trajectory& poses_;
  SE3 right_from_left_;
};

std::string class_of(const StereoMatch& match, const FeatureSet& left, const FeatureSet& right) {
  if (match.sigma < 1) return match.sigma < 0.15f ? "aligned, below .15 px" : "aligned, above";
  const float sigma = std::hypot(left.sigmas[match.left], right.sigmas[match.right]);
  return sigma <= StereoMatchingOptions().max_unaligned_sigma ? "not aligned, kept by default"
                                                              : "not aligned, left out";
}

Scene scene_of(const Options& options) {
  SceneOptions scene;
  scene.kind = parse_scene_kind(options.scene);
  scene.seed = options.scene_seed;
  scene.low_texture = parse_low_texture(options.texture);
  ThreadPool pool(options.threads);
  return make_scene(scene, pool);
}

std::map<std::string, Tally> measure(Dataset& dataset, const FeatureFamily& family,
                                     const Truth& truth) {
  StereoMatchingOptions matching;
  matching.max_unaligned_sigma = 10;  // all of them
  std::map<std::string, Tally> tallies;
  while (const auto frame = dataset.next()) {
    if (!frame->usable()) continue;
    const FeatureSet left = family.extractor->extract(frame->images[0], {});
    const FeatureSet right = family.extractor->extract(frame->images[1], {});
    const SE3 world_from_left = truth.world_from_left(frame->time);
    for (const StereoMatch& match :
         match_stereo(left, frame->images[0], right, frame->images[1], dataset.rig(), matching)) {
      const auto error = truth.error_of(match, left, world_from_left);
      if (error) tallies[class_of(match, left, right)].add(*error, match.sigma);
    }
  }
  return tallies;
}

void print(const std::map<std::string, Tally>& tallies) {
  std::cout << "| partners | count | wrong | rms | stated | bias |\n|---|---|---|---|---|---|\n";
  for (const auto& [name, tally] : tallies) {
    const auto good = static_cast<double>(tally.errors.size());
    std::cout << fmt::format(
        "| {} | {} | {:.1f}% | {:.2f} | {:.2f} | {:+.2f} |\n", name,
        tally.wrong + tally.errors.size(), 100 * tally.wrong / (tally.wrong + good),
        std::sqrt(tally.squares / good), std::sqrt(tally.stated / good), median(tally.errors));
  }
}

void run(const Options& options) {
  DatasetOptions input;
  input.path = options.sequence;
  input.stereo = true;
  const auto dataset = open_dataset(input);
  RuntimeOptions inference;
  inference.threads = options.threads;
  Runtime runtime(inference);
  const Truth truth(scene_of(options), dataset->rig(), dataset->ground_truth());
  print(measure(*dataset, make_feature_family(options.family, runtime), truth));
}

}  // namespace
}  // namespace rover

int main(int argc, char** argv) {
  CLI::App program("How far stereo partners are from the truth");
  rover::Options options;
  program.add_option("sequence", options.sequence, "a folder of rover simulate")->required();
  program.add_option("--scene", options.scene, "as it was given to rover simulate");
  program.add_option("--texture", options.texture, "likewise");
  program.add_option("--scene-seed", options.scene_seed, "likewise");
  program.add_option("--family", options.family, "feature family");
  program.add_option("--threads", options.threads, "default 2");
  return rover::parse_and_run(program, argc, argv, [&] { rover::run(options); });
}
