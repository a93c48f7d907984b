// Times of the matchers for 256 to 1024 features per image, and of photometric alignment for a
// place and for a slant.

#include <benchmark/benchmark.h>

#include "rover/matching/guided_matching.h"
#include "rover/matching/lightglue_matcher.h"
#include "rover/matching/mutual_nearest_neighbour.h"
#include "rover/matching/patch_slant.h"
#include "rover/matching/stereo_matching.h"
#include "rover/matching/test_features.h"
#include "rover/matching/test_images.h"

namespace rover {
namespace {

void guided(benchmark::State& state) {
  const auto count = static_cast<int>(state.range(0));
  const FeatureSet a = random_features(count, 64, 1);
  const FeatureSet b = shuffled_features(a, 0.04f, 2);
  std::vector<GuidedQuery> queries;
  for (int i = 0; i < count; ++i) {
    queries.push_back({a.positions[i], 40, a.descriptors.row(i).data()});
  }
  for (auto _ : state) {
    const FeatureGrid grid(b);
    benchmark::DoNotOptimize(match_guided(queries, grid, {}));
  }
}
BENCHMARK(guided)->RangeMultiplier(2)->Range(256, 1024)->Unit(benchmark::kMicrosecond);

void mutual_nearest_neighbour(benchmark::State& state) {
  const auto count = static_cast<int>(state.range(0));
  const FeatureSet a = random_features(count, 64, 1);
  const FeatureSet b = shuffled_features(a, 0.04f, 2);
  const MutualNearestNeighbourMatcher matcher;
  for (auto _ : state) benchmark::DoNotOptimize(matcher.match({a}, {b}));
}
BENCHMARK(mutual_nearest_neighbour)
    ->RangeMultiplier(2)
    ->Range(256, 1024)
    ->Unit(benchmark::kMicrosecond);

// Arguments: features per image, layers.
void lightglue(benchmark::State& state, LightGlueOptions options, int descriptor_size) {
  Runtime runtime(RuntimeOptions{});
  options.max_layers = static_cast<int>(state.range(1));
  options.exit_share = 2;
  options.prune_matchability = 0;
  const LightGlueMatcher matcher(runtime, options);
  const FeatureSet a = random_features(static_cast<int>(state.range(0)), descriptor_size, 1);
  const FeatureSet b = shuffled_features(a, 0.04f, 2);
  for (auto _ : state) benchmark::DoNotOptimize(matcher.match({a}, {b}));
}
BENCHMARK_CAPTURE(lightglue, lighterglue, lighterglue_options(), 64)
    ->ArgsProduct({{256, 512, 1024}, {1, 3, 6}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(lightglue, aliked_n16, lightglue_options("lightglue-aliked-n16"), 128)
    ->ArgsProduct({{256, 512, 1024}, {1, 9}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void refine_patch(benchmark::State& state) {
  const SmoothTexture texture(3);
  const auto at = [](double x, double y) {
    return [=](const Eigen::Vector2d& p) { return Eigen::Vector2d(p.x() + x, p.y() + y); };
  };
  const cv::Mat image = texture.render({64, 64}, at(-0.7, 0.6));
  const auto patch = cut_patch(texture.render({64, 64}, at(0, 0)), {32, 32}).value();
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        refine_position(patch, image, {32, 32}, Eigen::Matrix2f::Identity(), {}));
  }
}
BENCHMARK(refine_patch)->Unit(benchmark::kMicrosecond);

// A surface that leans by 25 degrees, seen 15 degrees from where its patch was taken.
void slant_update(benchmark::State& state) {
  const SmoothTexture texture(3);
  SlantedWarp warp;
  warp.facing = Eigen::Matrix2f::Identity();
  warp.per_slant = {Eigen::Matrix2f{{-0.25f, 0}, {0, 0}}, Eigen::Matrix2f{{0, -0.25f}, {0, 0}}};
  const Eigen::Vector2d center(32, 32);
  const Eigen::Matrix2d patch_from_image = warp.at({0.4f, 0.2f}).cast<double>().inverse();
  const auto seen = [&](const Eigen::Vector2d& p) {
    return Eigen::Vector2d(center + patch_from_image * (p - center));
  };
  const cv::Mat image = texture.render({64, 64}, seen);
  const cv::Mat reference = texture.render({64, 64}, [](const Eigen::Vector2d& p) { return p; });
  const auto patch = cut_patch(reference, center.cast<float>()).value();
  for (auto _ : state) {
    benchmark::DoNotOptimize(update_slant(patch, image, center.cast<float>(), warp, {}, {}));
  }
}
BENCHMARK(slant_update)->Unit(benchmark::kMicrosecond);

// A pair of rectified images of one plane; every left feature has its partner.
void stereo(benchmark::State& state) {
  const SmoothTexture texture(5);
  constexpr float kDisparity = 20;
  const cv::Size size(1241, 376);
  const cv::Mat left = texture.render(size, [](const Eigen::Vector2d& p) { return p; });
  const cv::Mat right = texture.render(
      size, [](const Eigen::Vector2d& p) { return Eigen::Vector2d(p.x() + kDisparity, p.y()); });
  const Camera camera(CameraModel::kPinhole, size.width, size.height, {718, 718, 620, 188}, {});
  const Rig rig{{camera, camera},
                {SE3(), SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.54, 0, 0))}};
  const FeatureSet a = random_features(static_cast<int>(state.range(0)), 64, 1, size);
  FeatureSet b = a;
  for (auto& position : b.positions) position.x() -= kDisparity;
  for (auto _ : state) benchmark::DoNotOptimize(match_stereo(a, left, b, right, rig, {}));
}
BENCHMARK(stereo)->Arg(500)->Arg(1000)->Arg(1500)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace rover

BENCHMARK_MAIN();
