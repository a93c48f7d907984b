// How far the observations in a finished stereo map are from what the cameras really see, by
// tracing rays through the scene that `rover simulate` rendered (without --along). Prints one
// Markdown row per kind of observation:
//
//   rover simulate --scene room --rate 20 --output DIR
//   rover_map_truth_bench DIR
//
//   place       px, from the point that the landmark's first observation is of
//   disparity   px, along the epipolar line, as adjustments take it
//   from place  px, likewise, the partner as found against the observation's place, refined or not
//
// Each as median and 90% of the size.

#include <CLI/CLI.hpp>

#include <cmath>
#include <iostream>
#include <map>

#include <fmt/format.h>

#include "bench/command_line.h"
#include "bench/finished_map.h"
#include "bench/scene_truth.h"
#include "rover/base/quantile.h"

namespace rover {
namespace {

struct Errors {
  std::vector<double> place, disparity, from_place;  // px, sizes
};

class Comparison {
 public:
  Comparison(const Map& map, const SceneTruth& truth, const Rig& rig)
      : map_(map), truth_(truth), rig_(rig) {}

  std::map<std::string, Errors> run() {
    for (const Landmark& landmark : map_.landmarks()) compare(landmark);
    return std::move(errors_);
  }

 private:
  void compare(const Landmark& landmark) {
    const auto& first = landmark.observations.front();
    const Frame& reference = map_.at(first.keyframe).frame;
    const SE3 world_from_first = truth_.world_from_left(reference.time);
    const auto point =
        truth_.point_at(reference[first.feature].pixel.cast<double>(), world_from_first);
    if (!point) return;
    const Eigen::Vector3d in_world = world_from_first * *point;
    for (const auto& seen : landmark.observations) {
      const Frame& frame = map_.at(seen.keyframe).frame;
      Errors& errors = errors_[frame[seen.feature].refined ? "refined" : "not refined"];
      const SE3 world_from_left = truth_.world_from_left(frame.time);
      compare_disparity(frame, seen.feature, world_from_left, errors);
      if (seen != first) {
        compare_place(frame[seen.feature], world_from_left.inverse() * in_world, errors);
      }
    }
  }

  void compare_place(const Observation& observation, const Eigen::Vector3d& point,
                     Errors& errors) const {
    const auto seen = rig_.cameras[0].project(point);
    if (seen) errors.place.push_back((observation.pixel.cast<double>() - *seen).norm());
  }

  void compare_disparity(const Frame& frame, int feature, const SE3& world_from_left,
                         Errors& errors) const {
    const StereoObservation* partner = frame.stereo_of(feature);
    if (!partner || frame[feature].stereo_rejected) return;
    const Eigen::Vector2d place = frame[feature].pixel.cast<double>();
    const auto add = [&](const Eigen::Vector2d& right, std::vector<double>& to) {
      const auto error = truth_.disparity_error(place, right, world_from_left);
      if (error) to.push_back(std::abs(*error));
    };
    add(place + frame.disparity(feature).cast<double>(), errors.disparity);
    add(partner->pixel.cast<double>(), errors.from_place);
  }

  const Map& map_;
  const SceneTruth& truth_;
  const Rig& rig_;
  std::map<std::string, Errors> errors_;
};

std::string cells(const std::vector<double>& sizes) {
  return fmt::format("{:.2f}, {:.2f}", median(sizes), quantile(sizes, 0.9));
}

void print(const std::map<std::string, Errors>& errors) {
  std::cout << "| observations | count | place | disparity | from place |\n|---|---|---|---|---|\n";
  for (const auto& [kind, of] : errors) {
    std::cout << fmt::format("| {} | {} | {} | {} | {} |\n", kind, of.place.size(), cells(of.place),
                             cells(of.disparity), cells(of.from_place));
  }
}

void run(const SimulatedSequence& sequence) {
  DatasetOptions input;
  input.path = sequence.path;
  input.stereo = true;
  const auto dataset = open_dataset(input);
  System system(Config(), dataset->rig().in_camera_frame(), Mode::kStereo);
  // The last image may lie beyond the last pose of the ground truth.
  const Trajectory& poses = dataset->ground_truth();
  require(!poses.empty(), "{}: no ground truth; use a sequence of rover simulate", sequence.path);
  run_through(system, *dataset, poses.back().time);
  system.adjust_largest_map();
  const auto map = largest_map_of(system);
  const SceneTruth truth(sequence.make(), dataset->rig(), dataset->ground_truth());
  print(Comparison(*map, truth, dataset->rig()).run());
}

}  // namespace
}  // namespace rover

int main(int argc, char** argv) {
  CLI::App program("How far a map's observations are from the truth");
  rover::SimulatedSequence sequence;
  sequence.add_options(program);
  return rover::parse_and_run(program, argc, argv, [&] { rover::run(sequence); });
}
