#include "rover/networks/runtime.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <onnxruntime_cxx_api.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "rover/base/error.h"
#include "rover/base/thread_pool.h"

namespace rover {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

#define SKIP_WITHOUT_MODEL(runtime, file) \
  try {                                   \
    (runtime).find(file);                 \
  } catch (const InputError& error) {     \
    GTEST_SKIP() << error.what();         \
  }

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "(no error)";
}

fs::path make_folder(const std::string& name) {
  const auto folder = fs::path(::testing::TempDir()) / ("rover_runtime_" + name);
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

// Recorded by the Python reference implementation; see docs/networks.md.
std::vector<float> reference(const std::string& name) {
  const fs::path folder = fs::path(ROVER_SOURCE_DIR) / "tests/data/networks";
  const auto entry = nlohmann::json::parse(std::ifstream(folder / "reference.json")).at(name);
  std::size_t count = 1;
  for (const std::size_t length : entry.at("shape")) count *= length;
  std::vector<float> values(count);
  std::ifstream file(folder / "reference.bin", std::ios::binary);
  file.seekg(static_cast<std::streamoff>(entry.at("offset").get<std::size_t>() * sizeof(float)));
  file.read(reinterpret_cast<char*>(values.data()),
            static_cast<std::streamsize>(count * sizeof(float)));
  EXPECT_TRUE(file.good());
  return values;
}

// A picture of stripes; sizes are multiples of 32.
struct Input {
  Input(int width, int height) : values(static_cast<std::size_t>(width) * height) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<float>(i % 37 + i / 53 % 91) / 128;
    }
    view = {values, {1, 1, height, width}};
  }
  std::vector<float> values;
  TensorView view;
};

TEST(Runtime, SaysWhichModelIsMissingAndHowToMakeIt) {
  RuntimeOptions options;
  options.models = make_folder("empty");
  Runtime runtime(options);
  EXPECT_THAT(
      message_of([&] { runtime.load("xfeat.onnx"); }),
      AllOf(HasSubstr("xfeat.onnx"), HasSubstr(options.models.string()), HasSubstr("make build")));
  EXPECT_THAT(message_of([&] { runtime.load("superpoint.onnx"); }),
              AllOf(HasSubstr("licence"), HasSubstr("SUPERPOINT_WEIGHTS=FILE")));
}

TEST(Runtime, LooksInTheFolderOfTheEnvironment) {
  ::setenv("ROVER_MODELS", "/nowhere/models", 1);
  EXPECT_EQ(model_folders(), std::vector<fs::path>{"/nowhere/models"});
  Runtime runtime({});
  EXPECT_THAT(message_of([&] { runtime.find("xfeat.onnx"); }), HasSubstr("/nowhere/models"));
  ::unsetenv("ROVER_MODELS");
  EXPECT_GE(model_folders().size(), 4u);
}

TEST(Runtime, RefusesDamagedModels) {
  Runtime whole({});
  SKIP_WITHOUT_MODEL(whole, "xfeat.onnx");
  RuntimeOptions options;
  options.models = make_folder("damaged");
  const auto cut = options.models / "xfeat.onnx";
  fs::copy_file(whole.find("xfeat.onnx"), cut);
  fs::resize_file(cut, fs::file_size(cut) / 2);
  std::ofstream(options.models / "text.onnx") << "this is no model";
  std::ofstream(options.models / "empty.onnx").close();
  Runtime runtime(options);
  for (const char* file : {"xfeat.onnx", "text.onnx", "empty.onnx"}) {
    EXPECT_THAT(message_of([&] { runtime.load(file); }),
                AllOf(HasSubstr(file), HasSubstr("damaged")));
  }
}

TEST(Runtime, ChecksItsOptions) {
  RuntimeOptions options;
  options.threads = 0;
  EXPECT_THROW(Runtime{options}, InputError);
  options = {};
  options.models = "/nowhere/models";
  EXPECT_THROW(Runtime{options}, InputError);
}

TEST(Runtime, OffersADeviceOnlyWithItsProvider) {
  const auto providers = Ort::GetAvailableProviders();
  for (const auto& [device, provider] :
       {std::pair{Device::kCuda, "CUDAExecutionProvider"},
        std::pair{Device::kTensorRt, "TensorrtExecutionProvider"}}) {
    if (std::find(providers.begin(), providers.end(), provider) != providers.end()) continue;
    RuntimeOptions options;
    options.device = device;
    EXPECT_THAT(message_of([&] { Runtime runtime(options); }),
                AllOf(HasSubstr(provider), HasSubstr("--device cpu")));
  }
}

TEST(Runtime, HasAPoolOfAsManyThreads) {
  RuntimeOptions options;
  options.threads = 3;
  EXPECT_EQ(Runtime(options).thread_pool()->threads(), 3);
}

TEST(Network, GivesTheReferenceValues) {
  Runtime runtime({});
  SKIP_WITHOUT_MODEL(runtime, "xfeat_keypoints.onnx");
  const auto network = runtime.load("xfeat_keypoints.onnx");
  ASSERT_EQ(network->input_names(), std::vector<std::string>{"image"});
  auto image = reference("image");
  for (float& gray : image) gray /= 255;
  const TensorView input{image, {1, 1, 96, 128}};
  const auto outputs = network->run({&input, 1});
  ASSERT_EQ(outputs.size(), network->output_names().size());
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const auto expected = reference("xfeat." + network->output_names()[i]);
    ASSERT_EQ(outputs[i].values.size(), expected.size());
    float largest = 0, error = 0;
    for (std::size_t k = 0; k < expected.size(); ++k) {
      largest = std::max(largest, std::abs(expected[k]));
      error = std::max(error, std::abs(expected[k] - outputs[i].values[k]));
    }
    EXPECT_LT(error, 1e-3f * largest) << network->output_names()[i];
  }
}

TEST(Network, IsSharedAndOutlivesItsRuntime) {
  std::shared_ptr<const Network> network;
  std::vector<Network::Output> outputs;
  {
    Runtime runtime({});
    SKIP_WITHOUT_MODEL(runtime, "xfeat.onnx");
    network = runtime.load("xfeat.onnx");
    EXPECT_EQ(network, runtime.load("xfeat.onnx"));
  }
  const Input input(64, 96);
  outputs = network->run({&input.view, 1});
  network.reset();
  for (const float value : outputs[1].values) EXPECT_TRUE(value >= 0 && value <= 1);
}

TEST(Network, RefusesWrongInputs) {
  Runtime runtime({});
  SKIP_WITHOUT_MODEL(runtime, "xfeat.onnx");
  const auto network = runtime.load("xfeat.onnx");
  EXPECT_THROW(network->run({}), std::invalid_argument);
  const Input input(64, 64);
  const TensorView flat{input.values, {64, 64}};
  EXPECT_THROW(network->run({&flat, 1}), std::exception);
}

TEST(Network, GivesTheSameBytesFromSeveralThreads) {
  Runtime runtime({});
  SKIP_WITHOUT_MODEL(runtime, "xfeat.onnx");
  const auto network = runtime.load("xfeat.onnx");
  const Input input(320, 224);
  const auto expected = network->run({&input.view, 1});
  std::vector<std::jthread> threads;
  for (int t = 0; t < 3; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 5; ++i) {
        const auto outputs = network->run({&input.view, 1});
        for (std::size_t k = 0; k < outputs.size(); ++k) {
          EXPECT_TRUE(std::ranges::equal(outputs[k].values, expected[k].values));
        }
      }
    });
  }
}

long resident_kilobytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word == "VmRSS:") break;
  }
  long kilobytes = 0;
  status >> kilobytes;
  return kilobytes;
}

TEST(Network, KeepsItsMemoryWhenShapesVary) {
  Runtime runtime({});
  SKIP_WITHOUT_MODEL(runtime, "lighterglue_input.onnx");
  const auto network = runtime.load("lighterglue_input.onnx");
  const std::vector<float> keypoints(2 * 1000, 0.1f), descriptors(64 * 1000, 0.125f);
  const auto run = [&](std::int64_t n) {
    const TensorView inputs[] = {
        {std::span(keypoints).first(static_cast<std::size_t>(2 * n)), {n, 2}},
        {std::span(descriptors).first(static_cast<std::size_t>(64 * n)), {n, 64}}};
    network->run(inputs);
  };
  run(1000);
  const long before = resident_kilobytes();
  for (std::int64_t n = 1; n <= 1000; ++n) run(n);
  EXPECT_LT(resident_kilobytes() - before, 8 * 1024);
}

}  // namespace
}  // namespace rover
