// How well families match over wide baselines: pairs of the sparse EuRoC V1_01 images, 12 to 45
// degrees and 0.4 to 2 m apart. Prints one Markdown row per family and matcher:
//
//   rover_wide_baseline_bench [--families NAME...] [--budget 600] [--pairs 90] [--radius PX]
//                             [--layers N...] [--min-similarity S] [--threads 2]
//
//   matches    per pair, mean
//   precision  share of all matches whose ground-truth epipolar distance is below 3 px
//   AUC@t      area under the share of pairs whose relative pose (essential matrix by RANSAC, the
//              larger of the errors of rotation and direction of translation) is better than t deg
//   layers     mean number that LightGlue ran
//   ms         mean time of a match on this machine

#include <CLI/CLI.hpp>

#include <chrono>
#include <cmath>
#include <iostream>
#include <numbers>

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>

#include "bench/command_line.h"
#include "rover/base/error.h"
#include "rover/features/extractor_factory.h"
#include "rover/matching/epipolar.h"
#include "rover/matching/feature_family.h"
#include "rover/matching/lightglue_matcher.h"
#include "rover/matching/mutual_nearest_neighbour.h"
#include "rover/matching/real_pairs.h"

namespace rover {
namespace {

struct Options {
  std::vector<std::string> families = {"xfeat-corner", "xfeat", "orb"};
  int budget = 600, pairs = 90, threads = 2;
  std::optional<int> radius;
  float min_similarity = 0;  // of mutual nearest neighbours
  std::vector<int> layers;   // of LightGlue, each on its own row with early exit off
};

struct Tally {
  int pairs = 0, matches = 0, correct = 0, layers = 0;
  double milliseconds = 0;
  std::vector<double> pose_errors;  // degrees, one per pair
};

double degrees(double radians) { return radians * 180 / std::numbers::pi; }

// The larger of the errors of the rotation and of the translation's direction; 180 if there is no
// pose.
double pose_error(const std::vector<Match>& matches, const std::vector<ObservedRay>& a,
                  const std::vector<ObservedRay>& b, const SE3& truth, double focal_length) {
  std::vector<cv::Point2d> points_a, points_b;
  for (const Match& match : matches) {
    const Eigen::Vector2d p = a[match.a].direction.hnormalized();
    const Eigen::Vector2d q = b[match.b].direction.hnormalized();
    points_a.emplace_back(p.x(), p.y());
    points_b.emplace_back(q.x(), q.y());
  }
  if (points_a.size() < 6) return 180;
  const cv::Mat camera = cv::Mat::eye(3, 3, CV_64F);
  cv::Mat mask, rotation, translation;
  const cv::Mat essential = cv::findEssentialMat(points_a, points_b, camera, cv::RANSAC, 0.9999,
                                                 1.0 / focal_length, mask);
  if (essential.rows != 3) return 180;
  cv::recoverPose(essential, points_a, points_b, camera, rotation, translation, mask);
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Eigen::Matrix3d r = Eigen::Map<const RowMajor>(rotation.ptr<double>());
  const Eigen::Vector3d t = Eigen::Map<const Eigen::Vector3d>(translation.ptr<double>());
  const double turn = Eigen::AngleAxisd(r.transpose() * truth.rotation_matrix()).angle();
  const double cosine = t.dot(truth.translation.normalized()) / t.norm();
  return degrees(std::max(turn, std::acos(std::clamp(cosine, -1.0, 1.0))));
}

// Area under the curve of recall over error up to a threshold, as in the LightGlue paper.
double area_under_curve(std::vector<double> errors, double threshold) {
  std::sort(errors.begin(), errors.end());
  double area = 0, last_error = 0, last_recall = 0;
  for (std::size_t i = 0; i < errors.size() && errors[i] < threshold; ++i) {
    const double recall = static_cast<double>(i + 1) / static_cast<double>(errors.size());
    area += (errors[i] - last_error) * 0.5 * (recall + last_recall);
    last_error = errors[i];
    last_recall = recall;
  }
  return (area + (threshold - last_error) * last_recall) / threshold;
}

class Bench {
 public:
  Bench(const real_pairs::Sequence& sequence, const Options& options)
      : sequence_(sequence),
        options_(options),
        pairs_(real_pairs::wide_pairs(sequence, options.pairs)) {}

  void extract(const Extractor& extractor) {
    features_.assign(sequence_.frames.size(), std::nullopt);
    rays_.assign(sequence_.frames.size(), {});
    ExtractionRequest request;
    request.budget = options_.budget;
    for (const auto& [a, b] : pairs_) {
      for (const int frame : {a, b}) {
        if (features_[frame]) continue;
        features_[frame] = extractor.extract(sequence_.frames[frame].left_image(), request);
        rays_[frame] = observe_rays(sequence_.rig.cameras[0], features_[frame]->positions);
      }
    }
  }

  void row(const std::string& name, const Matcher& matcher) const {
    Tally tally;
    for (const auto& [a, b] : pairs_) add(matcher, a, b, tally);
    const double pairs = tally.pairs;
    fmt::print("| {} | {:.0f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.1f} | {:.1f} |\n", name,
               tally.matches / pairs, static_cast<double>(tally.correct) / tally.matches,
               area_under_curve(tally.pose_errors, 5), area_under_curve(tally.pose_errors, 10),
               area_under_curve(tally.pose_errors, 20), tally.layers / pairs,
               tally.milliseconds / pairs);
    std::cout.flush();
  }

 private:
  void add(const Matcher& matcher, int a, int b, Tally& tally) const {
    const auto start = std::chrono::steady_clock::now();
    std::vector<Match> matches;
    if (const auto* lightglue = dynamic_cast<const LightGlueMatcher*>(&matcher)) {
      auto result = lightglue->run({*features_[a]}, {*features_[b]});
      matches = std::move(result.matches);
      tally.layers += result.layers;
    } else {
      matches = matcher.match({*features_[a]}, {*features_[b]});
    }
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
    const SE3 truth = sequence_.relative_pose(a, b);
    for (const Match& match : matches) {
      if (epipolar_distance(rays_[a][match.a], rays_[b][match.b], truth) < 3) ++tally.correct;
    }
    ++tally.pairs;
    tally.matches += static_cast<int>(matches.size());
    tally.milliseconds += time.count();
    tally.pose_errors.push_back(
        pose_error(matches, rays_[a], rays_[b], truth, sequence_.rig.cameras[0].focal_length()));
  }

  const real_pairs::Sequence& sequence_;
  const Options& options_;
  std::vector<std::pair<int, int>> pairs_;
  std::vector<std::optional<FeatureSet>> features_;
  std::vector<std::vector<ObservedRay>> rays_;
};

void measure_family(const std::string& name, Runtime& runtime, const Options& options,
                    Bench& bench) {
  const FeatureFamily family = make_feature_family(name, runtime);
  ExtractorOptions extractor;
  extractor.radius = options.radius;
  extractor.adaptive_threshold = false;  // every image gives its budget
  bench.extract(*make_extractor(name, runtime, extractor));
  if (name != "orb") {
    bench.row(name + ", mutual nearest neighbour",
              MutualNearestNeighbourMatcher({options.min_similarity, 1.0f}));
  }
  bench.row(name + ", its matcher", *family.matcher);
  LightGlueOptions layered =
      name.starts_with("xfeat") ? lighterglue_options() : lightglue_options("lightglue-" + name);
  for (const int layers : options.layers) {
    layered.max_layers = layers;
    layered.exit_share = 2;
    bench.row(fmt::format("{}, {} layers", name, layers), LightGlueMatcher(runtime, layered));
  }
}

void run(const Options& options) {
  const auto sequence = real_pairs::euroc();
  require(!sequence.frames.empty(), "no images in {}", real_pairs::data_folder().string());
  RuntimeOptions runtime_options;
  runtime_options.threads = options.threads;
  Runtime runtime(runtime_options);
  Bench bench(sequence, options);
  fmt::print("| | matches | precision | AUC@5 | @10 | @20 | layers | ms |\n");
  fmt::print("|---|---|---|---|---|---|---|---|\n");
  for (const auto& name : options.families) measure_family(name, runtime, options, bench);
}

}  // namespace
}  // namespace rover

int main(int argc, char** argv) {
  rover::Options options;
  CLI::App app("Matching over wide baselines");
  app.add_option("--families", options.families);
  app.add_option("--budget", options.budget);
  app.add_option("--pairs", options.pairs);
  app.add_option("--radius", options.radius, "of the non-maximum suppression, px");
  app.add_option("--layers", options.layers);
  app.add_option("--min-similarity", options.min_similarity, "of mutual nearest neighbours");
  app.add_option("--threads", options.threads);
  return rover::parse_and_run(app, argc, argv, [&] { rover::run(options); });
}
