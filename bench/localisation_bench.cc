// How well extractors find the same points again: real images against themselves under known small
// homographies, both with noise. Prints one Markdown row per family:
//
//   rover_localisation_bench [--families NAME...] [--budget 500] [--images FOLDER...]
//
//   @3 @1 @0.5  share of the first image's points with one of the second within so many px
//   sigma       px per axis: 1.4826 median of the residuals' absolute values, of those within 3 px
//   ratio       the same of residuals over the standard deviation that the extractor claims for
//               the pair, of mutual nearest points within 1.5 px: 1 if it knows itself
//   cells       share of the cells of an 8x6 grid that hold a point
//   ms          least time of an extraction on this machine

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <set>

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "bench/command_line.h"
#include "rover/base/error.h"
#include "rover/base/random.h"
#include "rover/features/extractor_factory.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<std::string> families = {"xfeat-corner", "xfeat",      "aliked-t16",
                                       "aliked-n16",   "superpoint", "orb"};
  std::vector<std::string> folders;
  int budget = 500, images = 8;  // images per folder
  double noise = 3;              // gray levels
  std::optional<int> radius;
  std::optional<float> spread;
};

// What one family gathers over all images.
struct Tally {
  int points = 0, within3 = 0, within1 = 0, within_half = 0;
  std::vector<double> residuals, ratios;
  double cells = 0, milliseconds = 1e9;
  int images = 0;
};

std::vector<cv::Mat> load_images(const Options& options) {
  std::vector<cv::Mat> images;
  for (const fs::path folder : options.folders) {
    std::set<fs::path> files;
    if (fs::is_directory(folder)) {
      for (const auto& entry : fs::directory_iterator(folder)) files.insert(entry.path());
    }
    std::cerr << folder << ": " << files.size() << " images\n";
    const std::vector<fs::path> list(files.begin(), files.end());
    const std::size_t step = std::max<std::size_t>(1, list.size() / options.images);
    for (std::size_t i = step / 2; i < list.size(); i += step) {
      images.push_back(cv::imread(list[i].string(), cv::IMREAD_GRAYSCALE));
    }
  }
  require(!images.empty(), "no images were found; name folders of images with --images");
  return images;
}

// Turns by up to 10 degrees, scales by up to 10%, shifts by up to 20 px, tilts a little.
cv::Matx33d small_homography(cv::Size size, Random& random) {
  const double angle = random.uniform(-0.17, 0.17), scale = random.uniform(0.9, 1.1);
  const double c = scale * std::cos(angle), s = scale * std::sin(angle);
  const double x = size.width / 2.0, y = size.height / 2.0;
  const cv::Matx33d centre(1, 0, -x, 0, 1, -y, 0, 0, 1), back(1, 0, x, 0, 1, y, 0, 0, 1);
  const cv::Matx33d turn(c, -s, random.uniform(-20, 20), s, c, random.uniform(-20, 20),
                         random.uniform(-1e-4, 1e-4), random.uniform(-1e-4, 1e-4), 1);
  return back * turn * centre;
}

cv::Mat with_noise(const cv::Mat& image, double sigma, Random& random) {
  cv::Mat noisy = image.clone();
  for (auto& pixel : cv::Mat_<std::uint8_t>(noisy)) {
    pixel = cv::saturate_cast<std::uint8_t>(pixel + sigma * random.gaussian());
  }
  return noisy;
}

Eigen::Vector2d map_point(const cv::Matx33d& h, const Eigen::Vector2f& p) {
  const cv::Vec3d mapped = h * cv::Vec3d(p.x(), p.y(), 1);
  return {mapped[0] / mapped[2], mapped[1] / mapped[2]};
}

std::size_t nearest(const std::vector<Eigen::Vector2d>& points, const Eigen::Vector2d& query) {
  const auto closer = [&](const auto& a, const auto& b) {
    return (a - query).squaredNorm() < (b - query).squaredNorm();
  };
  return static_cast<std::size_t>(std::min_element(points.begin(), points.end(), closer) -
                                  points.begin());
}

void compare(const FeatureSet& a, const FeatureSet& b, const cv::Matx33d& h, Tally& tally) {
  std::vector<Eigen::Vector2d> mapped, found;
  for (const auto& p : a.positions) mapped.push_back(map_point(h, p));
  for (const auto& p : b.positions) found.push_back(p.cast<double>());
  const Eigen::AlignedBox2d inside(
      Eigen::Vector2d(16, 16), Eigen::Vector2d(b.image_size.width - 17, b.image_size.height - 17));
  for (std::size_t i = 0; i < mapped.size(); ++i) {
    if (!inside.contains(mapped[i])) continue;
    const std::size_t j = nearest(found, mapped[i]);
    const Eigen::Vector2d residual = found[j] - mapped[i];
    const double distance = residual.norm();
    ++tally.points;
    tally.within3 += distance < 3;
    tally.within1 += distance < 1;
    tally.within_half += distance < 0.5;
    if (distance >= 3) continue;
    for (const double r : residual) tally.residuals.push_back(std::abs(r));
    if (distance >= 1.5 || nearest(mapped, found[j]) != i) continue;
    for (const double r : residual) {
      tally.ratios.push_back(std::abs(r) / std::hypot(a.sigmas[i], b.sigmas[j]));
    }
  }
}

double robust_sigma(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return 1.4826 * *middle;
}

double covered_cells(const FeatureSet& features) {
  std::set<std::pair<int, int>> cells;
  for (const auto& p : features.positions) {
    cells.emplace(static_cast<int>(8 * p.x() / static_cast<float>(features.image_size.width)),
                  static_cast<int>(6 * p.y() / static_cast<float>(features.image_size.height)));
  }
  return static_cast<double>(cells.size()) / 48;
}

Tally measure(const Extractor& extractor, const std::vector<cv::Mat>& images,
              const Options& options) {
  Tally tally;
  Random random(1);
  ExtractionRequest request;
  request.budget = options.budget;
  for (const auto& image : images) {
    const cv::Matx33d h = small_homography(image.size(), random);
    cv::Mat warped;
    cv::warpPerspective(image, warped, h, image.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
    const auto a = extractor.extract(with_noise(image, options.noise, random), request);
    const auto start = std::chrono::steady_clock::now();
    const auto b = extractor.extract(with_noise(warped, options.noise, random), request);
    const std::chrono::duration<double, std::milli> spent =
        std::chrono::steady_clock::now() - start;
    compare(a, b, h, tally);
    tally.cells += covered_cells(a);
    tally.milliseconds = std::min(tally.milliseconds, spent.count());
    ++tally.images;
  }
  return tally;
}

void print_row(const std::string& family, const Tally& tally) {
  const auto share = [&](int count) { return static_cast<double>(count) / tally.points; };
  fmt::print("| {} | {:.0f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.0f} |\n",
             family, static_cast<double>(tally.points) / tally.images, share(tally.within3),
             share(tally.within1), share(tally.within_half), robust_sigma(tally.residuals),
             robust_sigma(tally.ratios), tally.cells / tally.images, tally.milliseconds);
}

void run(const Options& options) {
  Runtime runtime({});
  const auto images = load_images(options);
  ExtractorOptions extraction;
  extraction.adaptive_threshold = false;
  extraction.radius = options.radius;
  extraction.spread = options.spread;
  fmt::print("| | points | @3 | @1 | @0.5 | sigma | ratio | cells | ms |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& family : options.families) {
    try {
      print_row(family, measure(*make_extractor(family, runtime, extraction), images, options));
    } catch (const InputError& error) {
      std::cerr << family << ": " << error.what() << "\n";
    }
  }
}

}  // namespace
}  // namespace rover

int main(int argc, char** argv) {
  const std::string data = ROVER_SOURCE_DIR "/../shared/data/";
  rover::Options options;
  options.folders = {data + "tum_rgbd/freiburg1_xyz/rgb",
                     data + "euroc/V1_01_sparse_stereo/mav0/cam0/data",
                     data + "kitti/00_first201/image_0"};
  CLI::App app("Localisation of features under known homographies");
  app.add_option("--families", options.families, "extractors");
  app.add_option("--images", options.folders, "folders of images");
  app.add_option("--budget", options.budget, "features per image");
  app.add_option("--per-folder", options.images, "images taken from each folder");
  app.add_option("--noise", options.noise, "standard deviation, gray levels");
  app.add_option("--radius", options.radius, "of the non-maximum suppression, px");
  app.add_option("--spread", options.spread, "share of the budget spread over a grid");
  return rover::parse_and_run(app, argc, argv, [&] { rover::run(options); });
}
