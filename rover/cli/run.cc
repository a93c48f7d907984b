// rover run: a dataset in, trajectories, a map and a summary out.

#include <unistd.h>

#include <chrono>
#include <iostream>
#include <memory>
#include <thread>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "rover/base/error.h"
#include "rover/cli/commands.h"
#include "rover/cli/input_queue.h"
#include "rover/cli/input_troubles.h"
#include "rover/cli/run_recorder.h"
#include "rover/cli/run_summary.h"
#include "rover/datasets/dataset.h"
#include "rover/slam/system.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

struct RunOptions {
  std::string dataset, mode, output, format = "auto", config, calibration, mask, family;
  std::string device = "cpu";
  bool realtime = false;
  bool no_final_adjustment = false;
  int max_frames = 0;
  int threads = 0;
  std::int64_t seed = -1;
  double frame_rate = 0;
};

Device parse_device(const std::string& name) {
  if (name == "cpu") return Device::kCpu;
  if (name == "cuda") return Device::kCuda;
  if (name == "tensorrt") return Device::kTensorRt;
  throw InputError("--device '{}' is not known; use cpu, cuda or tensorrt", name);
}

Config make_config(const RunOptions& options) {
  Config config;
  if (!options.config.empty()) load_config(options.config, config);
  if (!options.family.empty()) config.family = options.family;
  if (options.threads > 0) config.runtime.threads = options.threads;
  if (options.seed >= 0) config.seed = static_cast<std::uint64_t>(options.seed);
  config.runtime.device = parse_device(options.device);
  if (options.realtime) config.execution = Execution::kConcurrent;
  config.check();
  return config;
}

std::unique_ptr<Dataset> open_input(const RunOptions& options, Mode mode) {
  DatasetOptions dataset;
  dataset.path = options.dataset;
  dataset.format = parse_dataset_format(options.format);
  if (!options.calibration.empty()) dataset.calibration = options.calibration;
  dataset.stereo = is_stereo(mode);
  dataset.inertial = is_inertial(mode);
  dataset.frame_rate = options.frame_rate;
  return open_dataset(dataset);
}

fs::path prepare_output(const std::string& name) {
  std::error_code error;
  fs::create_directories(name, error);
  if (error || access(name.c_str(), W_OK) != 0) {
    throw InputError("--output {}: cannot be written ({}); choose a folder that you may write to",
                     name, error ? error.message() : "permission denied");
  }
  return name;
}

cv::Mat read_mask(const std::string& file) {
  if (file.empty()) return {};
  require(fs::is_regular_file(file), "--mask {}: no such file; give an image", file);
  cv::Mat mask = cv::imread(file, cv::IMREAD_GRAYSCALE);
  if (mask.empty()) throw InputError("--mask {}: cannot be read as an image", file);
  return mask;
}

// Tells how far a run is: a line that rewrites itself on a terminal, nothing elsewhere.
class Progress {
 public:
  explicit Progress(std::size_t frames) : frames_(frames), terminal_(isatty(STDERR_FILENO)) {}
  ~Progress() {
    if (terminal_) std::cerr << "\r\033[K";
  }

  void show(std::int64_t index, const TrackingResult& result) {
    const auto now = std::chrono::steady_clock::now();
    if (!terminal_ || now - shown_ < std::chrono::milliseconds(200)) return;
    shown_ = now;
    std::cerr << fmt::format("\r\033[Kframe {} of {}  {}  {} landmarks tracked", index + 1, frames_,
                             to_string(result.state), result.inliers)
              << std::flush;
  }

 private:
  std::size_t frames_;
  bool terminal_;
  std::chrono::steady_clock::time_point shown_{};
};

// Offers frames at the pace of their stamps (realtime), or as fast as they are asked for.
class Pacer {
 public:
  explicit Pacer(bool realtime) : realtime_(realtime) {}

  // Waits until the frame is there. False: the next one is there already, so this one is dropped.
  bool admit(Timestamp time, std::optional<Timestamp> next) {
    if (!realtime_) return true;
    if (!started_) {
      started_ = true;
      first_ = time;
      start_ = std::chrono::steady_clock::now();
    }
    if (next && std::chrono::steady_clock::now() >= due(*next)) return false;
    std::this_thread::sleep_until(due(time));
    return true;
  }

 private:
  std::chrono::steady_clock::time_point due(Timestamp time) const {
    return start_ + std::chrono::nanoseconds(time - first_);
  }
  bool realtime_;
  bool started_ = false;
  Timestamp first_ = 0;
  std::chrono::steady_clock::time_point start_;
};

// One run from the first frame to the last.
class Run {
 public:
  Run(const RunOptions& options, Mode mode, Dataset& dataset, System& system)
      : options_(options),
        mode_(mode),
        dataset_(dataset),
        system_(system),
        troubles_(system.config().tracking.inertial.noise.gap),
        queue_(dataset) {}

  RunFacts execute(RunRecorder& recorder) {
    RunFacts facts;
    facts.mode = mode_;
    facts.realtime = options_.realtime;
    facts.dataset = fs::absolute(options_.dataset).lexically_normal();
    Progress progress(limit(dataset_.size()));
    Pacer pacer(options_.realtime);
    Stopwatch wall;
    std::optional<Timestamp> first;
    Timestamp last = 0;
    while (queue_.read_ahead(1) && facts.frames_offered < limit(facts.frames_offered + 1)) {
      PendingFrame pending = queue_.pop();
      queue_.read_ahead(1);
      last = pending.frame.time;
      if (!first) first = last;
      ++facts.frames_offered;
      offer(pending, pacer.admit(last, queue_.next_time()), recorder, progress);
    }
    system_.finish();
    recorder.add_mapping(system_.take_mapping_records());
    facts.sensor_seconds = first ? seconds_between(*first, last) : 0;
    facts.wall_seconds = wall.lap_ms() / 1000;
    facts.input = troubles_.describe();
    facts.input["notes"] = dataset_.notes();
    for (const std::string& line : troubles_.lines()) warn(line);
    return facts;
  }

 private:
  std::size_t limit(std::size_t frames) const {
    if (options_.max_frames <= 0) return frames;
    return std::min(frames, static_cast<std::size_t>(options_.max_frames));
  }

  void offer(PendingFrame& pending, bool admitted, RunRecorder& recorder, Progress& progress) {
    const SensorFrame& frame = pending.frame;
    troubles_.offer(frame);
    queue_.give_readings(pending, system_.imu_needed(frame.time), [&](const ImuSample& sample) {
      if (!system_.add_imu(sample)) troubles_.refuse_sample();
    });
    if (!frame.usable()) {
      warn_of_image(frame);
      recorder.add_unusable(frame.index, frame.time, "skipped");
    } else if (!admitted) {
      recorder.add_unusable(frame.index, frame.time, "dropped");
    } else {
      Stopwatch watch;
      const cv::Mat right = frame.images.size() > 1 ? frame.images[1] : cv::Mat();
      const TrackingResult result = system_.add_images(frame.time, frame.images[0], right);
      recorder.add(frame.index, result, watch.lap_ms());
      if (const std::string line = troubles_.hear(result); !line.empty()) warn(line);
      recorder.add_sample(frame.images[0], result, system_);
      progress.show(frame.index, result);
    }
  }

  static void warn(const std::string& line) { std::cerr << "warning: " << line << '\n'; }
  static void warn_of_image(const SensorFrame& frame) {
    warn(fmt::format("frame {} at {} s skipped: {}", frame.index, format_seconds(frame.time),
                     frame.problems.empty() ? "no image" : frame.problems.front()));
  }

  const RunOptions& options_;
  Mode mode_;
  Dataset& dataset_;
  System& system_;
  InputTroubles troubles_;
  InputQueue queue_;
};

void run(const RunOptions& options) {
  const Mode mode = parse_mode(options.mode);
  const Config config = make_config(options);
  const auto dataset = open_input(options, mode);
  const fs::path output = prepare_output(options.output);
  for (const std::string& note : dataset->notes()) std::cerr << "note: " << note << '\n';
  const Rig rig = is_inertial(mode) ? dataset->rig() : dataset->rig().in_camera_frame();
  System system(config, rig, mode, read_mask(options.mask), dataset->imu_calibration());
  RunRecorder recorder;
  RunFacts facts = Run(options, mode, *dataset, system).execute(recorder);
  require(facts.frames_offered > 0, "{}: holds no frame; check the dataset", options.dataset);
  if (!options.no_final_adjustment) {
    write_unadjusted(output, system);
    facts.final_adjustment_ms = system.adjust_largest_map();
  }
  std::cout << write_results(output, system, recorder, facts);
}

}  // namespace

void add_run(CLI::App& program) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = program.add_subcommand("run", "Run SLAM on a dataset");
  command->add_option("--dataset", options->dataset, "Folder or video")->required();
  command->add_option("--mode", options->mode, "mono, stereo, mono-inertial or stereo-inertial")
      ->required();
  command->add_option("--output", options->output, "Folder for the results")->required();
  command->add_option("--format", options->format, "auto, euroc, tum, kitti, folder or video");
  command->add_option("--config", options->config, "YAML file; see docs/configuration.md");
  command->add_option("--calibration", options->calibration,
                      "EuRoC sensor.yaml or Kalibr camchain.yaml");
  command->add_option("--mask", options->mask, "Image that is black where features are unwanted");
  command->add_option("--family", options->family, "Feature family; default xfeat-corner");
  command->add_flag("--realtime", options->realtime,
                    "Pace the input by its stamps, map on a second thread, drop late frames");
  command->add_option("--max-frames", options->max_frames, "Stop after so many frames")
      ->check(CLI::PositiveNumber);
  command->add_option("--threads", options->threads, "Threads of the networks; default 2")
      ->check(CLI::PositiveNumber);
  command->add_option("--seed", options->seed, "Seed of all randomness; default 1")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--frame-rate", options->frame_rate, "Hz, for folders without time stamps")
      ->check(CLI::PositiveNumber);
  command->add_option("--device", options->device, "cpu, cuda or tensorrt");
  command->add_flag("--no-final-adjustment", options->no_final_adjustment,
                    "Leave the map as it is after the last frame");
  command->callback([options] { run(*options); });
}

}  // namespace rover
