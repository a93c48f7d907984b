// Time of each extractor, and of the stages of the default one, on one frame of 640x480 noise-like
// texture (the time does not depend on what is seen, but for the number of features).

#include <benchmark/benchmark.h>

#include <opencv2/core.hpp>

#include "rover/base/error.h"
#include "rover/base/random.h"
#include "rover/features/descriptor_map.h"
#include "rover/features/extractor_factory.h"
#include "rover/features/image_input.h"
#include "rover/features/local_maxima.h"
#include "rover/features/selection.h"

namespace rover {
namespace {

constexpr int kWidth = 640, kHeight = 480;

// Random blocks of 8 px: corners everywhere, as in a cluttered scene.
cv::Mat textured_image() {
  cv::Mat image(kHeight, kWidth, CV_8UC1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const auto bits = hash_seed(1, static_cast<std::uint64_t>((y / 8) * 1000 + x / 8));
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(bits & 255);
    }
  }
  return image;
}

Runtime& runtime() {
  static Runtime shared({});
  return shared;
}

ExtractionRequest request_of(int budget) {
  ExtractionRequest request;
  request.budget = budget;
  return request;
}

void extraction(benchmark::State& state, const std::string& family) {
  ExtractorOptions options;
  options.adaptive_threshold = false;  // as many features as the budget says
  std::unique_ptr<Extractor> extractor;
  try {
    extractor = make_extractor(family, runtime(), options);
  } catch (const InputError& error) {
    state.SkipWithError(error.what());
    return;
  }
  const cv::Mat image = textured_image();
  const ExtractionRequest request = request_of(static_cast<int>(state.range(0)));
  int features = 0;
  for (auto _ : state) features = extractor->extract(image, request).size();
  state.counters["features"] = features;
}
// Registers one family with budgets from 256 to 1024 features.
#define ROVER_EXTRACTION(name, family)        \
  BENCHMARK_CAPTURE(extraction, name, family) \
      ->ArgsProduct({{256, 512, 800, 1024}})  \
      ->MeasureProcessCPUTime()               \
      ->UseRealTime()                         \
      ->Unit(benchmark::kMillisecond)
ROVER_EXTRACTION(xfeat_corner, "xfeat-corner");
ROVER_EXTRACTION(xfeat, "xfeat");
ROVER_EXTRACTION(aliked_t16, "aliked-t16");
ROVER_EXTRACTION(aliked_n16, "aliked-n16");
ROVER_EXTRACTION(superpoint, "superpoint");
ROVER_EXTRACTION(orb, "orb");
#undef ROVER_EXTRACTION

void xfeat_network(benchmark::State& state) {
  const auto network = runtime().load("xfeat.onnx");
  std::vector<float> memory;
  const auto input = network_input(textured_image(), 1.0f / 255, {}, kernels::best_kernels(),
                                   *runtime().thread_pool(), memory);
  for (auto _ : state) benchmark::DoNotOptimize(network->run({&input, 1}));
}
BENCHMARK(xfeat_network)->MeasureProcessCPUTime()->UseRealTime()->Unit(benchmark::kMillisecond);

// Maps as the network would give them, and the response they lead to.
struct Maps {
  Maps() : reliability(kCells, 0.5f), planes(64 * kCells), response(image.total()) {
    for (std::size_t i = 0; i < planes.size(); ++i) {
      planes[i] = static_cast<float>(hash_seed(2, i) & 1023) - 500;
    }
  }

  void respond(const kernels::Kernels& loops, ThreadPool& pool) {
    const kernels::ImageView view{image.data, static_cast<std::ptrdiff_t>(image.step), kWidth,
                                  kHeight};
    pool.parallel_for(kHeight, [&](std::size_t begin, std::size_t end) {
      std::vector<float> scratch(static_cast<std::size_t>(kernels::corner_scratch_size(kWidth)));
      loops.corner_response(view, {reliability.data(), kWidth / 8, kHeight / 8},
                            static_cast<int>(begin), static_cast<int>(end), response.data(),
                            scratch.data());
    });
  }

  static constexpr std::size_t kCells = kWidth / 8 * kHeight / 8;
  cv::Mat image = textured_image();
  std::vector<float> reliability, planes, response;
};

void corner_response(benchmark::State& state) {
  const auto set = static_cast<kernels::InstructionSet>(state.range(0));
  if (!kernels::supported(set)) {
    state.SkipWithError("not supported by this machine");
    return;
  }
  Maps maps;
  ThreadPool one(1);
  for (auto _ : state) maps.respond(kernels::kernels(set), one);
}
BENCHMARK(corner_response)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

void local_maxima(benchmark::State& state) {
  Maps maps;
  ThreadPool one(1);
  maps.respond(kernels::best_kernels(), one);
  std::vector<float> scratch;
  const MaximaOptions options{.radius = static_cast<int>(state.range(0)), .floor = 0.1f};
  for (auto _ : state) {
    benchmark::DoNotOptimize(find_local_maxima({maps.response.data(), kWidth, kWidth, kHeight},
                                               options, nullptr, kernels::best_kernels(), one,
                                               scratch));
  }
}
BENCHMARK(local_maxima)->Arg(4)->Arg(6)->Unit(benchmark::kMicrosecond);

void selection(benchmark::State& state) {
  Maps maps;
  ThreadPool one(1);
  maps.respond(kernels::best_kernels(), one);
  std::vector<float> scratch;
  const auto candidates =
      find_local_maxima({maps.response.data(), kWidth, kWidth, kHeight}, {.radius = 4}, nullptr,
                        kernels::best_kernels(), one, scratch);
  state.counters["candidates"] = static_cast<double>(candidates.size());
  for (auto _ : state) {
    benchmark::DoNotOptimize(select_candidates(candidates, request_of(800), {}, 4));
  }
}
BENCHMARK(selection)->Unit(benchmark::kMicrosecond);

void descriptor_sampling(benchmark::State& state) {
  Maps maps;
  ThreadPool one(1);
  std::vector<Eigen::Vector2f> positions;
  Random random(3);
  for (int i = 0; i < 800; ++i) {
    positions.emplace_back(random.uniform(8, kWidth - 8), random.uniform(8, kHeight - 8));
  }
  std::vector<float> cells;
  for (auto _ : state) {
    const DescriptorMap map(maps.planes.data(), 64, kWidth / 8, kHeight / 8,
                            kernels::best_kernels(), one, cells);
    benchmark::DoNotOptimize(map.sample(positions, one));
  }
}
BENCHMARK(descriptor_sampling)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace rover

BENCHMARK_MAIN();
