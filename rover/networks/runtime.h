#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace rover {

class ThreadPool;

enum class Device { kCpu, kCuda, kTensorRt };

struct RuntimeOptions {
  int threads = 2;               // of the one pool that all graphs share
  Device device = Device::kCpu;  // another one needs a runtime that has its provider
  std::filesystem::path models;  // folder of the graphs; empty: searched, see model_folders()

  void check() const;
};

// A dense row-major tensor of floats given to a graph. The values stay the caller's.
struct TensorView {
  std::span<const float> values;
  std::vector<std::int64_t> shape;
};

class Network;

// ONNX Runtime with one thread pool for all graphs that does not spin while idle. Graphs made by it
// keep it alive. The same input gives the same bytes, run after run.
//
// ONNX Runtime has one environment per process: while one Runtime (or a graph of it) lives, others
// share its threads, whatever their own `threads` say; a warning is logged when that differs.
class Runtime {
 public:
  // Throws InputError if the device's provider is not in the ONNX Runtime at hand.
  explicit Runtime(const RuntimeOptions& options);
  ~Runtime();

  // Loads a graph by its file name in the models folder ("xfeat.onnx"); loaded once, then shared.
  // Throws InputError that names the file, the folders looked in and the command that makes it, or
  // that says that the file is damaged. May be called from several threads at once.
  std::shared_ptr<const Network> load(const std::string& file);

  // Where a file of the models folder ("xfeat.json") lies. Throws InputError as load() does.
  std::filesystem::path find(const std::string& file) const;

  // For loops around the graphs: as many threads as the graphs have.
  const std::shared_ptr<ThreadPool>& thread_pool() const;

  const RuntimeOptions& options() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

// A loaded graph. run() may be called from several threads at once.
class Network {
 public:
  virtual ~Network() = default;

  // A tensor that a graph returned. Movable and copyable (copies share the values), and the owner
  // of the runtime's own buffer: nothing is copied. Releases it with the last copy.
  struct Output {
    std::span<const float> values;
    std::vector<std::int64_t> shape;
    std::shared_ptr<const void> owner;
  };

  // Inputs and outputs in the graph's own order; all of them floats. Throws std::invalid_argument
  // for a wrong number of inputs, Ort::Exception for shapes that the graph does not take.
  virtual std::vector<Output> run(std::span<const TensorView> inputs) const = 0;

  virtual const std::vector<std::string>& input_names() const = 0;
  virtual const std::vector<std::string>& output_names() const = 0;
};

// Where models are looked for, in order: $ROVER_MODELS (if set, nowhere else), beside the program
// (../share/rover/models, models, ../models), the build folder.
std::vector<std::filesystem::path> model_folders();

}  // namespace rover
