// rover simulate: a flight through a made scene, rendered, with inertial data and ground truth.

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "rover/base/error.h"
#include "rover/base/thread_pool.h"
#include "rover/cli/commands.h"
#include "rover/datasets/imu_file.h"
#include "rover/simulation/closed_flight.h"
#include "rover/simulation/motion_fit.h"
#include "rover/simulation/rigs.h"
#include "rover/simulation/sequence_simulation.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

// A made flight begins at this time of the sensors' clock.
constexpr Timestamp kEpoch = 1'700'000'000 * kNanosecondsPerSecond;
constexpr double kLap = 40;  // s

struct SimulateOptions {
  std::string output, scene = "room", rig = "euroc", motion = "smooth", lighting = "constant";
  std::string texture = "rich", textures, along, imu, cache;
  bool overwrite = false, real_imu = false, synthetic_imu = false;
  double duration = 0, start = 0, still = 0, speed = 1;
  int laps = 0;
  double rate = 20, imu_rate = 200, exposure = 4, rolling_shutter = 0;
  int samples = 4, moving_objects = 0, threads = 2;
  double calibration_error = 0;
  double reference_error = 0;
  std::string preset;
  std::uint64_t scene_seed = 1, seed = 1;

  bool paper() const { return preset == "paper"; }
};

// Tells how far the simulation is: a line that rewrites itself on a terminal, nothing elsewhere.
class Progress {
 public:
  Progress() : terminal_(isatty(STDERR_FILENO)) {}
  ~Progress() { clear(); }

  void say(const std::string& what) {
    if (terminal_) std::cerr << "\r\033[K" << what << std::flush;
  }
  void show(std::size_t done, std::size_t all) {
    const auto now = std::chrono::steady_clock::now();
    if (now - shown_ < std::chrono::milliseconds(200)) return;
    shown_ = now;
    const std::size_t width = 30, filled = width * done / all;
    say(fmt::format("[{}{}] {}%", std::string(filled, '='), std::string(width - filled, ' '),
                    100 * done / all));
  }
  void clear() { say(""); }

 private:
  bool terminal_;
  std::chrono::steady_clock::time_point shown_{};
};

// A motion with its inertial data, made or real.
struct Flight {
  std::optional<SplineMotion> motion;
  Timestamp epoch = kEpoch;
  ImuRecording imu;
  ImuCalibration calibration;
  std::optional<MotionFitResiduals> real;  // what the motion leaves of real inertial data
};

fs::path inertial_file_beside(const fs::path& ground_truth) {
  const fs::path folder = ground_truth.parent_path();
  for (const char* name : {"../imu0/data.csv", "../imu0/data.csv.gz", "imu0.csv", "imu0.csv.gz"}) {
    const fs::path file = folder / name;
    if (fs::exists(file)) return file;
  }
  throw InputError("--real-imu: no imu0/data.csv or imu0.csv[.gz] beside {}; name it with --imu",
                   ground_truth.string());
}

std::vector<ImuSample> read_real_imu(const SimulateOptions& options) {
  if (!options.imu.empty()) return read_imu_file(options.imu);
  if (options.real_imu) return read_imu_file(inertial_file_beside(options.along));
  return {};
}

ImuSynthesisOptions imu_options(const SimulateOptions& options) {
  ImuSynthesisOptions imu;
  imu.calibration.rate = options.imu_rate;
  imu.seed = options.seed;
  return imu;
}

// The same way in less time.
SplineMotion hurried(const SplineMotion& motion, double speed) {
  return {motion.begin(), motion.knot_interval() / speed, motion.control()};
}

// A real flight: where a ground truth went, and what its inertial sensor read if that is wanted.
Flight fly_along(const SimulateOptions& options) {
  const Trajectory ground_truth = read_trajectory(options.along);
  const std::vector<ImuSample> imu = read_real_imu(options);
  MotionFitOptions fit_options;
  fit_options.start = options.start;
  fit_options.duration = options.speed * options.duration;
  const FittedMotion fit = fit_motion(ground_truth, imu, fit_options);
  Flight flight;
  flight.motion = options.speed == 1 ? fit.motion : hurried(fit.motion, options.speed);
  flight.epoch = fit.origin;
  flight.calibration = imu_options(options).calibration;
  const bool is_real = !imu.empty() && !options.synthetic_imu;
  flight.imu = is_real ? real_imu(fit, imu, fit.origin)
                       : synthesize_imu(*flight.motion, fit.origin, imu_options(options));
  if (is_real) flight.real = fit.residuals;
  return flight;
}

void tell(const MotionFitResiduals& real) {
  std::cout << fmt::format(
      "real inertial data: below 5 Hz {:.4f} rad/s and {:.3f} m/s2 off the ground truth's motion, "
      "in the worst 5 s {:.4f} and {:.3f}\n",
      real.slow_gyroscope, real.slow_accelerometer, real.worst_gyroscope, real.worst_accelerometer);
  if (!real.contradicts()) return;
  std::cerr
      << "warning: inertial data and ground truth contradict each other there; choose another "
         "stretch with --start and --duration, or give --synthetic-imu\n";
}

SE3 between(const SE3& a, const SE3& b, double share) {
  return {a.rotation.slerp(share, b.rotation), (1 - share) * a.translation + share * b.translation};
}

// A flight whose last third is as a shaking hand would fly it, from one course to the other within
// two seconds.
SplineMotion shaken_at_last(const FlightVolume& volume, FlightOptions options) {
  const SplineMotion smooth = make_flight(volume, options);
  options.style = FlightStyle::kShaking;
  const SplineMotion shaking = make_flight(volume, options);
  const double change = smooth.begin() + 2 * (smooth.end() - smooth.begin()) / 3;
  std::vector<SE3> control = smooth.control();
  for (std::size_t i = 0; i < control.size(); ++i) {
    const double time = smooth.begin() + smooth.knot_interval() * static_cast<double>(i);
    const double share = std::clamp((time - change) / 2.0, 0.0, 1.0);
    control[i] = between(control[i], shaking.control()[i], share * share * (3 - 2 * share));
  }
  return {smooth.begin(), smooth.knot_interval(), control};
}

double made_duration(const FlightVolume& volume, FlightStyle style,
                     const SimulateOptions& options) {
  if (options.duration > 0) return options.duration;
  return options.laps > 0 ? kLap : std::max(20.0, lap_duration(volume, style));
}

SplineMotion made_motion(const FlightVolume& volume, const FlightOptions& made,
                         const SimulateOptions& options) {
  if (options.paper()) return shaken_at_last(volume, made);
  if (options.laps > 0) return make_closed_flight(volume, made, options.laps);
  return make_flight(volume, made);
}

// A made flight through what the scene leaves free.
Flight fly_through(const FlightVolume& volume, const Rig& rig, const SimulateOptions& options) {
  FlightOptions made;
  made.style = options.still > 0 ? FlightStyle::kHover : parse_flight_style(options.motion);
  if (options.still > 0) made.still = options.still;
  made.duration = made_duration(volume, made.style, options);
  made.body_from_camera = rig.body_from_camera[0];
  made.seed = options.scene_seed;
  Flight flight;
  flight.motion = made_motion(volume, made, options);
  flight.calibration = imu_options(options).calibration;
  flight.imu = synthesize_imu(*flight.motion, kEpoch, imu_options(options));
  return flight;
}

std::vector<Eigen::Vector3d> places_of(const Motion& motion) {
  constexpr double kInterval = 0.05;  // s
  std::vector<Eigen::Vector3d> places;
  for (double t = motion.begin(); t <= motion.end(); t += kInterval) {
    places.push_back(motion.at(t).world_from_body.translation);
  }
  return places;
}

// The rig and the troubles of the paper's own recording (1440x1080 monocular, 100 Hz inertial
// data): light that changes, then weak texture, then shaking, on one round of a corridor.
void apply_preset(SimulateOptions& options) {
  if (options.preset.empty()) return;
  require(options.paper(), "--preset '{}' is not known; use paper", options.preset);
  require(options.along.empty(), "--preset does not go with --along");
  options.scene = "corridor";
  options.rig = "paper";
  options.lighting = "sweep";
  options.motion = "smooth";
  options.imu_rate = 100;
}

// Frames of a lap; each lap must show the same at its frames.
std::size_t lap_frames(const SimulateOptions& options) {
  if (options.laps == 0) return 0;
  const double frames = (options.duration > 0 ? options.duration : kLap) * options.rate;
  require(std::abs(frames - std::round(frames)) < 1e-6,
          "--laps: a lap of --duration {} s does not hold a whole number of frames at --rate {}",
          options.duration, options.rate);
  return static_cast<std::size_t>(std::lround(frames));
}

SequenceOptions sequence_options(const SimulateOptions& options) {
  SequenceOptions sequence;
  sequence.output = options.output;
  sequence.overwrite = options.overwrite;
  const fs::path beside = fs::absolute(fs::path(options.output) / "x").parent_path().parent_path();
  if (options.cache != "none") {
    sequence.cache = options.cache.empty() ? beside / "render-cache" : fs::path(options.cache);
  }
  sequence.rig = make_rig(options.rig);
  sequence.scene.kind = parse_scene_kind(options.scene);
  sequence.scene.seed = options.scene_seed;
  sequence.scene.low_texture = parse_low_texture(options.texture);
  sequence.scene.moving_objects = options.moving_objects;
  if (!options.textures.empty()) sequence.scene.photographs = options.textures;
  sequence.render.samples = options.samples;
  sequence.render.exposure = 1e-3 * options.exposure;
  sequence.render.readout = 1e-3 * options.rolling_shutter;
  sequence.lighting = parse_lighting_style(options.lighting);
  if (sequence.lighting == LightingStyle::kDim) sequence.sensor = SensorOptions::dim();
  sequence.frame_rate = options.rate;
  sequence.lap_frames = lap_frames(options);
  sequence.calibration_error = options.calibration_error;
  sequence.reference_error.position = options.reference_error / 1000;
  sequence.seed = options.seed;
  return sequence;
}

void check(const SimulateOptions& options, const SequenceOptions& sequence) {
  require(options.duration >= 0 && options.duration <= 3600,
          "--duration {}: must lie between 0 and 3600 s", options.duration);
  require(options.threads > 0, "--threads {}: must be positive", options.threads);
  require(!options.along.empty() || (options.imu.empty() && !options.real_imu),
          "--imu and --real-imu go with --along FILE");
  require(options.imu.empty() || !options.real_imu, "give either --imu FILE or --real-imu");
  require(!options.synthetic_imu || options.real_imu || !options.imu.empty(),
          "--synthetic-imu goes with --real-imu or --imu FILE");
  require(options.along.empty() || options.still == 0, "--still does not go with --along");
  require(options.speed >= 0.1 && options.speed <= 10, "--speed {}: must lie between 0.1 and 10",
          options.speed);
  require(options.speed == 1 || !options.along.empty(), "--speed goes with --along FILE");
  require(options.speed == 1 || options.synthetic_imu || (options.imu.empty() && !options.real_imu),
          "--speed: the real inertial data are those of the real speed; give --synthetic-imu");
  require(options.laps >= 0 && options.laps <= 1000, "--laps {}: must lie between 0 and 1000",
          options.laps);
  require(options.laps == 0 || (options.along.empty() && options.still == 0 && !options.paper()),
          "--laps does not go with --along, --still and --preset");
  require(sequence.overwrite || !fs::exists(sequence.output),
          "--output {}: exists already; choose another folder or give --overwrite", options.output);
  parse_flight_style(options.motion);
  sequence.check();
}

void simulate(SimulateOptions options) {
  apply_preset(options);
  SequenceOptions sequence = sequence_options(options);
  check(options, sequence);
  ThreadPool pool(options.threads);
  Progress progress;
  Flight flight;
  if (!options.along.empty()) {
    progress.say("fitting a smooth motion to the ground truth");
    flight = fly_along(options);
    sequence.scene.around = places_of(*flight.motion);
    sequence.scene.check();
  }
  sequence.scene.plain_leg = options.paper();
  progress.say("building the scene");
  const Scene scene = make_scene(sequence.scene, pool);
  if (!flight.motion) flight = fly_through(scene.flight_volume, sequence.rig, options);
  if (options.paper()) {
    sequence.lighting_until = (flight.motion->end() - flight.motion->begin()) / 3;
  }
  const SimulatedFlight simulated{*flight.motion, flight.epoch, flight.imu, flight.calibration};
  write_sequence(sequence, scene, simulated, pool,
                 [&](std::size_t done, std::size_t all) { progress.show(done, all); });
  progress.clear();
  const auto frames = frame_times(*flight.motion, flight.epoch, options.rate).size();
  std::cout << fmt::format("{}: {} frames of {} camera{}, {} inertial samples\n", options.output,
                           frames, sequence.rig.size(), sequence.rig.size() == 1 ? "" : "s",
                           flight.imu.samples.size());
  if (flight.real) tell(*flight.real);
}

void add_scene_options(CLI::App* command, SimulateOptions& options) {
  command->add_option("--scene", options.scene, "room, hall, corridor or street; default room");
  command->add_option("--scene-seed", options.scene_seed, "Seed of scene and flight; default 1");
  command->add_option("--texture", options.texture, "rich or low; default rich");
  command->add_option("--textures", options.textures, "Folder of photographs to cover the scene");
  command->add_option("--moving-objects", options.moving_objects, "How many; default 0");
  command->add_option("--lighting", options.lighting,
                      "constant, dim, flicker or sweep; default constant");
}

void add_motion_options(CLI::App* command, SimulateOptions& options) {
  command->add_option("--duration", options.duration,
                      "s; default 20, one lap in corridor and street, all with --along; with "
                      "--laps of one, default 40");
  command->add_option("--motion", options.motion, "smooth, aggressive or shaking; default smooth");
  command->add_option("--still", options.still, "Seconds to stand still in the middle");
  command->add_option("--along", options.along,
                      "Fly along a ground truth: EuRoC csv or TUM text, also gzip");
  command->add_option("--start", options.start, "Begin so many s into that ground truth");
  command->add_option("--speed", options.speed,
                      "Fly along it so many times as fast, with made inertial data; default 1");
  command->add_option("--laps", options.laps,
                      "Fly a closed course in a room or hall so many times; rendered once");
  command->add_option("--imu", options.imu, "Real inertial data of that flight");
  command->add_flag("--real-imu", options.real_imu, "The same, from the imu0 beside it");
  command->add_flag("--synthetic-imu", options.synthetic_imu,
                    "With either: they shape the motion, but made ones are written");
}

void add_sensor_options(CLI::App* command, SimulateOptions& options) {
  command->add_option("--rig", options.rig,
                      "euroc, tumvi, mono, paper, or a sensor.yaml or its folder; default euroc");
  command->add_option("--rate", options.rate, "Images per second; default 20");
  command->add_option("--imu-rate", options.imu_rate, "Inertial samples per second; default 200");
  command->add_option("--seed", options.seed, "Seed of noise and biases; default 1");
  command->add_option("--reference-error", options.reference_error,
                      "mm, rms, that the ground truth is off, as motion capture is; default 0");
  command->add_option("--calibration-error", options.calibration_error,
                      "px by which the delivered calibration is off; default 0: exact");
  command->add_option("--samples", options.samples, "Rays per pixel; default 4");
  command->add_option("--exposure", options.exposure, "ms; default 4");
  command->add_option("--rolling-shutter", options.rolling_shutter,
                      "ms from the first row to the last; default 0: global shutter");
}

}  // namespace

void add_simulate(CLI::App& program) {
  auto options = std::make_shared<SimulateOptions>();
  CLI::App* command = program.add_subcommand("simulate", "Render a flight with ground truth");
  command->add_option("--output", options->output, "Folder for the sequence")->required();
  command->add_flag("--overwrite", options->overwrite, "Replace a folder that exists");
  add_scene_options(command, *options);
  add_motion_options(command, *options);
  add_sensor_options(command, *options);
  command->add_option("--cache", options->cache,
                      "Folder for noise-free images, or none; default render-cache beside output");
  command->add_option("--preset", options->preset,
                      "paper: its rig, then changing light, weak texture and shaking in turn");
  command->add_option("--threads", options->threads, "Default 2");
  command->callback([options] { simulate(*options); });
}

}  // namespace rover
