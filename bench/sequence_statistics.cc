// How alike sequences look to a SLAM system: features per image by family, and what a run makes of
// them. For comparing simulated sequences with real ones; see docs/simulator.md.
//
//   build/rover_sequence_statistics mono ../shared/data/euroc/V1_01_clip simulated/twin

#include <cmath>
#include <iostream>

#include <fmt/format.h>

#include "bench/command_line.h"
#include "rover/datasets/dataset.h"
#include "rover/matching/feature_family.h"
#include "rover/slam/system.h"

namespace {

using rover::Map;

struct Mean {
  double sum = 0;
  int count = 0;
  void add(double value) { sum += value, ++count; }
  double value() const { return count > 0 ? sum / count : 0; }
};

std::unique_ptr<rover::Dataset> open(const std::string& path, bool stereo) {
  rover::DatasetOptions options;
  options.path = path;
  options.stereo = stereo;
  return rover::open_dataset(options);
}

// Features that pass each family's own threshold when nothing was matched yet, without a budget, in
// every fifth image.
void print_features(const std::string& path) {
  rover::Runtime runtime{rover::RuntimeOptions{}};
  for (const std::string family : {"aliked-n16", "xfeat", "xfeat-corner", "orb"}) {
    rover::ExtractorOptions options;
    options.min_features = 1;
    const auto extractor = rover::make_feature_family(family, runtime, options).extractor;
    const auto dataset = open(path, false);
    rover::ExtractionRequest request;
    request.budget = 100'000;
    Mean features;
    while (const auto frame = dataset->next()) {
      if (frame->index % 5 != 0 || !frame->usable()) continue;
      features.add(extractor->extract(frame->images[0], request).size());
    }
    std::cout << fmt::format("  {} features: {:.0f}\n", family, features.value());
  }
}

// Of each observation in the keyframes, px.
double reprojection_rms(const Map& map) {
  Mean squares;
  for (const rover::Landmark& landmark : map.landmarks()) {
    for (const auto& seen : landmark.observations) {
      const rover::Frame& frame = map.at(seen.keyframe).frame;
      const rover::Camera& camera = map.rig().cameras[0];
      const rover::SE3 pose = frame.world_from_body * map.rig().body_from_camera[0];
      const auto pixel = camera.project(pose.inverse() * landmark.position);
      if (pixel) squares.add((*pixel - frame[seen.feature].pixel.cast<double>()).squaredNorm());
    }
  }
  return std::sqrt(squares.value());
}

void print_run(const std::string& path, rover::Mode mode) {
  const auto dataset = open(path, mode == rover::Mode::kStereo);
  rover::System system(rover::Config(), dataset->rig().in_camera_frame(), mode);
  Mean matches, inliers;
  while (const auto frame = dataset->next()) {
    if (!frame->usable()) continue;
    const cv::Mat right = frame->images.size() > 1 ? frame->images[1] : cv::Mat();
    const auto result = system.add_images(frame->time, frame->images[0], right);
    if (result.state != rover::TrackingState::kOk) continue;
    matches.add(result.matches);
    inliers.add(result.inliers);
  }
  system.finish();
  system.adjust_largest_map();
  const auto largest = system.largest_map();
  if (!largest) return;
  const Map& map = *system.maps()[static_cast<std::size_t>(largest->value)];
  Mean observations, found;
  for (const rover::Landmark& landmark : map.landmarks()) {
    observations.add(static_cast<double>(landmark.observations.size()));
    found.add(landmark.found);
  }
  std::cout << fmt::format(
      "  frames tracked: {}\n  matches per frame: {:.0f}\n  share of inliers: {:.3f}\n"
      "  reprojection error, rms: {:.3f} px\n  keyframes per landmark: {:.2f}\n"
      "  frames per landmark: {:.1f}\n",
      matches.count, matches.value(), inliers.value() / matches.value(), reprojection_rms(map),
      observations.value(), found.value());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App program("How alike sequences look to a SLAM system");
  std::string mode;
  std::vector<std::string> sequences;
  program.add_option("mode", mode, "mono or stereo")->required();
  program.add_option("sequences", sequences, "dataset folders")->required();
  return rover::parse_and_run(program, argc, argv, [&] {
    for (const std::string& sequence : sequences) {
      std::cout << sequence << '\n';
      print_run(sequence, rover::parse_mode(mode));
      print_features(sequence);
    }
  });
}
