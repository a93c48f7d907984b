#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <cstdint>

namespace rover {

enum class Device { kCpu, kCuda, kTensorRt };

struct RuntimeOptions {
  int threads = 2;                     // of the one pool that all graphs share
  Device device = Device::kCpu;        // another one needs a runtime that has its provider
  std::filesystem::path models;        // folder of the graphs; empty: searched, see find_models()

  void check() const;
};

// A tensor of floats or ids given to a graph, or returned by it.
struct TensorView {
  std::span<const float> values;
  std::vector<std::int64_t> shape;
};

class Network;

// ONNX Runtime with one thread pool for all graphs that does not spin while idle. Graphs made by it
// keep it alive.
class Runtime {
 public:
  explicit Runtime(const RuntimeOptions& options);
  ~Runtime();

  // Loads a graph by its file name in the models folder ("xfeat.onnx"); loaded once, then shared.
  // Throws InputError that names the file, the folders looked in and the command that makes it.
  std::shared_ptr<const Network> load(const std::string& file);

  const RuntimeOptions& options() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

// A loaded graph. run() may be called from several threads at once.
class Network {
 public:
  virtual ~Network() = default;

  // Inputs and outputs in the graph's own order. The returned tensors own their memory.
  struct Output {
    std::vector<float> values;
    std::vector<std::int64_t> shape;
  };
  virtual std::vector<Output> run(std::span<const TensorView> inputs) const = 0;
  virtual const std::vector<std::string>& input_names() const = 0;
  virtual const std::vector<std::string>& output_names() const = 0;
};

// Where models are looked for, in order: $ROVER_MODELS, beside the program (../share/rover/models,
// models), the build folder.
std::vector<std::filesystem::path> model_folders();

}  // namespace rover
