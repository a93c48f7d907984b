// rover match: the features of two images, joined and drawn.

#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "rover/base/error.h"
#include "rover/cli/commands.h"
#include "rover/datasets/image_file.h"
#include "rover/matching/draw_matches.h"
#include "rover/matching/feature_family.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

struct MatchOptions {
  std::vector<std::string> images;
  std::string output, family = "xfeat-corner";
  int features = 800;
  int threads = 2;
};

// One image with what was found in it.
struct Picture {
  cv::Mat image;
  FeatureSet features;
};

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

Picture extract(const std::string& file, const MatchOptions& options, const FeatureFamily& family) {
  LoadedImage loaded = load_gray_image(file, {});
  require(loaded.problem.empty(), "{}", loaded.problem);
  ExtractionRequest request;
  request.budget = options.features;
  request.threshold = 0.0F;  // as many as were asked for, however weak
  const auto start = std::chrono::steady_clock::now();
  FeatureSet features = family.extractor->extract(loaded.image, request);
  std::cout << fmt::format("{}: {}x{} px, {} features in {:.1f} ms\n", file, loaded.image.cols,
                           loaded.image.rows, features.size(), milliseconds_since(start));
  return {std::move(loaded.image), std::move(features)};
}

std::vector<Match> join(const Picture& a, const Picture& b, const FeatureFamily& family) {
  const auto start = std::chrono::steady_clock::now();
  auto matches = family.matcher->match({a.features, &a.image}, {b.features, &b.image});
  std::cout << fmt::format("{} matches in {:.1f} ms ({})\n", matches.size(),
                           milliseconds_since(start), family.name);
  return matches;
}

// Under a temporary name of the same type first: imwrite goes by the extension.
void write_png(const fs::path& file, const cv::Mat& image) {
  const fs::path part = file.parent_path() / (file.stem().string() + ".part.png");
  std::error_code error;
  bool written = false;
  try {
    written = cv::imwrite(part.string(), image);
  } catch (const cv::Exception&) {
    written = false;
  }
  if (written) fs::rename(part, file, error);
  require(written && !error, "{}: cannot be written; check the folder and its permissions",
          file.string());
}

void check(const MatchOptions& options) {
  require(fs::path(options.output).extension() == ".png", "--output {}: must end in .png",
          options.output);
  require(options.features > 0, "--features {}: must be positive", options.features);
  require(options.threads > 0, "--threads {}: must be positive", options.threads);
}

void match(const MatchOptions& options) {
  check(options);
  RuntimeOptions runtime_options;
  runtime_options.threads = options.threads;
  Runtime runtime(runtime_options);
  const FeatureFamily family = make_feature_family(options.family, runtime);
  const Picture a = extract(options.images[0], options, family);
  const Picture b = extract(options.images[1], options, family);
  const auto matches = join(a, b, family);
  write_png(options.output, draw_matches(a.image, a.features, b.image, b.features, matches));
}

std::string known_families() {
  std::string names;
  for (const std::string& name : feature_family_names()) {
    names += (names.empty() ? "" : ", ") + name;
  }
  return names;
}

}  // namespace

void add_match(CLI::App& program) {
  const auto options = std::make_shared<MatchOptions>();
  CLI::App* command = program.add_subcommand("match", "Find, join and draw features of two images");
  command->add_option("images", options->images, "two images")->required()->expected(2);
  command->add_option("--output", options->output, "PNG file for the drawing")->required();
  command->add_option("--family", options->family, known_families() + " (xfeat-corner)");
  command->add_option("--features", options->features, "features per image (800)");
  command->add_option("--threads", options->threads, "threads of the networks (2)");
  command->callback([options] { match(*options); });
}

}  // namespace rover
