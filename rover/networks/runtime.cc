#include "rover/networks/runtime.h"

#include <onnxruntime_cxx_api.h>
#include <onnxruntime_session_options_config_keys.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <mutex>
#include <stdexcept>

#include "rover/base/error.h"
#include "rover/base/thread_pool.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

// The one environment of the process, with its threads. Arena of its own for all sessions: memory
// is that of the largest user, not the sum of all.
struct Environment {
  explicit Environment(int thread_count) : threads(thread_count) {
    Ort::ThreadingOptions threading;
    threading.SetGlobalIntraOpNumThreads(threads);
    threading.SetGlobalInterOpNumThreads(1);
    threading.SetGlobalSpinControl(0);
    env = Ort::Env(threading, ORT_LOGGING_LEVEL_ERROR, "rover");
    const auto memory = Ort::MemoryInfo::CreateCpu(OrtArenaAllocator, OrtMemTypeDefault);
    // Extend by what is asked for (1): doubling would keep up to twice the peak.
    const Ort::ArenaCfg arena(0, 1, -1, -1);
    env.CreateAndRegisterAllocator(memory, arena);
  }

  int threads;
  Ort::Env env{nullptr};
};

std::shared_ptr<Environment> shared_environment(int threads) {
  static std::mutex mutex;
  static std::weak_ptr<Environment> alive;
  std::lock_guard lock(mutex);
  if (auto environment = alive.lock()) {
    if (environment->threads != threads) {
      spdlog::warn("networks run on the {} threads of this process's first runtime, not on {}",
                   environment->threads, threads);
    }
    return environment;
  }
  auto environment = std::make_shared<Environment>(threads);
  alive = environment;
  return environment;
}

const char* device_name(Device device) {
  constexpr std::array kNames = {"cpu", "cuda", "tensorrt"};
  return kNames[static_cast<std::size_t>(device)];
}

void require_provider(Device device) {
  constexpr std::array kProviders = {"CPUExecutionProvider", "CUDAExecutionProvider",
                                     "TensorrtExecutionProvider"};
  const auto available = Ort::GetAvailableProviders();
  const auto* wanted = kProviders[static_cast<std::size_t>(device)];
  require(std::find(available.begin(), available.end(), wanted) != available.end(),
          "--device {}: the ONNX Runtime at hand has no {}; use --device cpu, or build with "
          "-DONNXRUNTIME_ROOT=<folder of a runtime that has it>",
          device_name(device), wanted);
}

Ort::SessionOptions session_options(Device device) {
  Ort::SessionOptions options;
  options.DisablePerSessionThreads();
  options.SetExecutionMode(ORT_SEQUENTIAL);
  options.SetGraphOptimizationLevel(ORT_ENABLE_ALL);
  options.SetDeterministicCompute(true);
  // Patterns are kept for every shape ever seen: memory would grow with the numbers of keypoints.
  options.DisableMemPattern();
  options.AddConfigEntry(kOrtSessionOptionsConfigUseEnvAllocators, "1");
  if (device == Device::kTensorRt) options.AppendExecutionProvider_TensorRT({});
  if (device != Device::kCpu) options.AppendExecutionProvider_CUDA({});
  return options;
}

std::vector<std::string> names_of(const Ort::Session& session, bool inputs) {
  Ort::AllocatorWithDefaultOptions allocator;
  std::vector<std::string> names;
  const auto count = inputs ? session.GetInputCount() : session.GetOutputCount();
  for (std::size_t i = 0; i < count; ++i) {
    names.emplace_back((inputs ? session.GetInputNameAllocated(i, allocator)
                               : session.GetOutputNameAllocated(i, allocator))
                           .get());
  }
  return names;
}

std::vector<const char*> pointers_to(const std::vector<std::string>& names) {
  std::vector<const char*> pointers;
  for (const auto& name : names) pointers.push_back(name.c_str());
  return pointers;
}

Network::Output to_output(Ort::Value value) {
  const auto info = value.GetTensorTypeAndShapeInfo();
  auto owner = std::make_shared<Ort::Value>(std::move(value));
  return {{owner->GetTensorData<float>(), info.GetElementCount()}, info.GetShape(), owner};
}

class Session final : public Network {
 public:
  Session(std::shared_ptr<Environment> environment, Device device, const fs::path& file)
      : environment_(std::move(environment)),
        session_(environment_->env, file.c_str(), session_options(device)),
        input_names_(names_of(session_, true)),
        output_names_(names_of(session_, false)),
        input_pointers_(pointers_to(input_names_)),
        output_pointers_(pointers_to(output_names_)) {}

  std::vector<Output> run(std::span<const TensorView> inputs) const override {
    if (inputs.size() != input_names_.size()) {
      throw std::invalid_argument("a network was given a wrong number of inputs");
    }
    const auto memory = Ort::MemoryInfo::CreateCpu(OrtArenaAllocator, OrtMemTypeDefault);
    std::vector<Ort::Value> values;
    for (const auto& input : inputs) {
      // The C API asks for a mutable pointer, but does not write to inputs.
      values.push_back(Ort::Value::CreateTensor<float>(
          memory, const_cast<float*>(input.values.data()), input.values.size(), input.shape.data(),
          input.shape.size()));
    }
    auto results = session_.Run({}, input_pointers_.data(), values.data(), values.size(),
                                output_pointers_.data(), output_pointers_.size());
    std::vector<Output> outputs;
    for (auto& result : results) outputs.push_back(to_output(std::move(result)));
    return outputs;
  }

  const std::vector<std::string>& input_names() const override { return input_names_; }
  const std::vector<std::string>& output_names() const override { return output_names_; }

 private:
  std::shared_ptr<Environment> environment_;
  mutable Ort::Session session_;  // Run() is thread-safe, but not const in the C++ API
  std::vector<std::string> input_names_, output_names_;
  std::vector<const char*> input_pointers_, output_pointers_;
};

std::string how_to_make(const std::string& file) {
  if (file.starts_with("superpoint")) {
    return "SuperPoint's licence forbids passing its weights on: get the official weight file and "
           "run `SUPERPOINT_WEIGHTS=FILE make build`";
  }
  return "run `make build`, which writes it";
}

fs::path program_folder() {
  std::error_code error;
  const auto program = fs::read_symlink("/proc/self/exe", error);
  return error ? fs::path() : program.parent_path();
}

}  // namespace

struct Runtime::State {
  RuntimeOptions options;
  std::shared_ptr<ThreadPool> pool;
  std::shared_ptr<Environment> environment;
  std::mutex mutex;
  std::map<std::string, std::shared_ptr<const Network>> loaded;
};

void RuntimeOptions::check() const {
  require(threads >= 1 && threads <= 256, "threads must be 1 to 256, not {}", threads);
  require(models.empty() || fs::is_directory(models), "models folder {} does not exist",
          models.string());
}

Runtime::Runtime(const RuntimeOptions& options) : state_(std::make_shared<State>()) {
  options.check();
  require_provider(options.device);
  state_->options = options;
  state_->pool = std::make_shared<ThreadPool>(options.threads);
  state_->environment = shared_environment(options.threads);
}

Runtime::~Runtime() = default;

const RuntimeOptions& Runtime::options() const { return state_->options; }

const std::shared_ptr<ThreadPool>& Runtime::thread_pool() const { return state_->pool; }

fs::path Runtime::find(const std::string& file) const {
  const auto folders =
      state_->options.models.empty() ? model_folders() : std::vector{state_->options.models};
  std::string looked_in;
  for (const auto& folder : folders) {
    if (fs::is_regular_file(folder / file)) return folder / file;
    looked_in += (looked_in.empty() ? "" : ", ") + folder.string();
  }
  throw InputError("the model {} was not found (looked in {}): {}", file, looked_in,
                   how_to_make(file));
}

std::shared_ptr<const Network> Runtime::load(const std::string& file) {
  std::lock_guard lock(state_->mutex);
  auto& network = state_->loaded[file];
  if (network) return network;
  const auto path = find(file);
  try {
    network = std::make_shared<Session>(state_->environment, state_->options.device, path);
  } catch (const Ort::Exception& error) {
    throw InputError("the model {} cannot be loaded, it may be damaged ({}): delete it and {}",
                     path.string(), error.what(), how_to_make(file));
  }
  return network;
}

std::vector<fs::path> model_folders() {
  if (const char* given = std::getenv("ROVER_MODELS"); given && *given) return {given};
  const auto program = program_folder();
  std::vector<fs::path> folders;
  for (const char* beside : {"../share/rover/models", "models", "../models"}) {
    if (!program.empty()) folders.push_back((program / beside).lexically_normal());
  }
  folders.emplace_back(ROVER_BUILD_MODELS);
  folders.emplace_back(ROVER_INSTALLED_MODELS);
  return folders;
}

}  // namespace rover
