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

#include <fmt/format.h>

#include "bench/command_line.h"
#include "bench/scene_truth.h"
#include "rover/base/quantile.h"
#include "rover/datasets/dataset.h"
#include "rover/matching/feature_family.h"
#include "rover/matching/stereo_matching.h"

namespace rover {
namespace {

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

std::string class_of(const StereoMatch& match, const FeatureSet& left, const FeatureSet& right) {
  if (match.sigma < 1) return match.sigma < 0.15f ? "aligned, below .15 px" : "aligned, above";
  const float sigma = std::hypot(left.sigmas[match.left], right.sigmas[match.right]);
  return sigma <= StereoMatchingOptions().max_unaligned_sigma ? "not aligned, kept by default"
                                                              : "not aligned, left out";
}

std::map<std::string, Tally> measure(Dataset& dataset, const FeatureFamily& family,
                                     const SceneTruth& truth) {
  StereoMatchingOptions matching;
  matching.max_unaligned_sigma = 10;  // all of them
  std::map<std::string, Tally> tallies;
  while (const auto frame = dataset.next()) {
    if (ends_before(dataset.ground_truth(), frame->time)) break;
    if (!frame->usable()) continue;
    const FeatureSet left = family.extractor->extract(frame->images[0], {});
    const FeatureSet right = family.extractor->extract(frame->images[1], {});
    const SE3 world_from_left = truth.world_from_left(frame->time);
    for (const StereoMatch& match :
         match_stereo(left, frame->images[0], right, frame->images[1], dataset.rig(), matching)) {
      const auto error = truth.disparity_error(left.positions[match.left].cast<double>(),
                                               match.position.cast<double>(), world_from_left);
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

void run(const SimulatedSequence& sequence, const std::string& family) {
  DatasetOptions input;
  input.path = sequence.path;
  input.stereo = true;
  const auto dataset = open_dataset(input);
  RuntimeOptions inference;
  inference.threads = sequence.threads;
  Runtime runtime(inference);
  const SceneTruth truth(sequence.make(), dataset->rig(), dataset->ground_truth());
  print(measure(*dataset, make_feature_family(family, runtime), truth));
}

}  // namespace
}  // namespace rover

int main(int argc, char** argv) {
  CLI::App program("How far stereo partners are from the truth");
  rover::SimulatedSequence sequence;
  std::string family = "xfeat-corner";
  sequence.add_options(program);
  program.add_option("--family", family, "feature family");
  return rover::parse_and_run(program, argc, argv, [&] { rover::run(sequence, family); });
}
