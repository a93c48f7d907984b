#include "rover/simulation/sequence_simulation.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "rover/base/error.h"
#include "rover/base/random.h"
#include "rover/base/thread_pool.h"
#include "rover/simulation/inertial_files.h"
#include "rover/simulation/renderer_cache.h"
#include "rover/simulation/rigs.h"
#include "rover/simulation/sequence_writer.h"

namespace rover {
namespace {

std::vector<Camera> true_cameras(const SequenceOptions& options) {
  std::vector<Camera> cameras;
  for (const Camera& camera : options.rig.cameras) {
    const auto seed = hash_seed(options.scene.seed, cameras.size(), 30);
    cameras.push_back(disturbed_camera(camera, options.calibration_error, seed));
  }
  return cameras;
}

// The images of a sequence, frame by frame and camera by camera, in two passes.
class ImageProduction {
 public:
  ImageProduction(const SequenceOptions& options, const Scene& scene, const SimulatedFlight& flight,
                  const SequenceWriter& writer, const RadianceCache& cache,
                  const SimulationProgress& progress)
      : options_(options),
        flight_(flight),
        writer_(writer),
        cache_(cache),
        progress_(progress),
        times_(frame_times(flight.motion, flight.epoch, options.frame_rate)),
        common_(hash_of(options.scene, options.render)),
        cameras_(true_cameras(options)),
        renderer_(scene, cameras_, options.render) {}

  void run(ThreadPool& pool) {
    means_.resize(times_.size());
    for_each_image(pool, rendered(), [&](std::size_t frame, int camera) { render(frame, camera); });
    control_exposure();
    for_each_image(pool, times_.size(),
                   [&](std::size_t frame, int camera) { expose(frame, camera); });
  }

  const std::vector<Timestamp>& times() const { return times_; }

 private:
  std::size_t cameras() const { return options_.rig.cameras.size(); }
  double seconds(std::size_t frame) const { return seconds_between(flight_.epoch, times_[frame]); }

  LightingStyle lighting(std::size_t frame) const {
    return seconds(frame) < options_.lighting_until ? options_.lighting : LightingStyle::kConstant;
  }

  // The frame of the first lap that shows the same, and how many there are.
  std::size_t in_first_lap(std::size_t frame) const {
    return options_.lap_frames > 0 ? frame % options_.lap_frames : frame;
  }
  std::size_t rendered() const {
    return options_.lap_frames > 0 ? std::min(options_.lap_frames, times_.size()) : times_.size();
  }

  // Threads take image after image: some take longer than others.
  template <class Work>
  void for_each_image(ThreadPool& pool, std::size_t frames, const Work& work) {
    std::atomic<std::size_t> next{0};
    const std::size_t count = frames * cameras();
    pool.parallel_for(static_cast<std::size_t>(pool.threads()), [&](std::size_t, std::size_t) {
      for (std::size_t i = next++; i < count; i = next++) {
        work(i / cameras(), static_cast<int>(i % cameras()));
        const std::lock_guard lock(mutex_);
        progress_(++done_, (rendered() + times_.size()) * cameras());
      }
    });
  }

  Shot shot(std::size_t frame, int camera) const {
    Shot shot = take_shot(flight_.motion, options_.rig.body_from_camera[camera], seconds(frame),
                          options_.render);
    shot.lamps = lamp_weights(lighting(frame), seconds(frame));
    shot.seed = hash_seed(static_cast<std::uint64_t>(times_[frame] - flight_.epoch), camera);
    return shot;
  }

  // Radiance as it is after storing, so that a second run from the cache gives the same bytes.
  cv::Mat radiance(std::size_t frame, int camera) const {
    const Shot taken = shot(in_first_lap(frame), camera);
    const std::string name = image_name(common_, cameras_[camera], taken);
    if (auto stored = cache_.load(name)) return *stored;
    cache_.store(name, renderer_.render(camera, taken));
    auto stored = cache_.load(name);
    require(stored.has_value(), "a noise-free image cannot be read again; is the cache changed?");
    return *stored;
  }

  void render(std::size_t frame, int camera) {
    const double mean = metered_mean(radiance(frame, camera));
    if (camera == 0) means_[frame] = mean;
  }

  void control_exposure() {
    for (std::size_t frame = rendered(); frame < means_.size(); ++frame) {
      means_[frame] = means_[in_first_lap(frame)];
    }
    for (std::size_t frame = 0; frame < means_.size(); ++frame) {
      means_[frame] *= flicker_factor(lighting(frame), seconds(frame), options_.seed);
    }
    for (const Camera& camera : options_.rig.cameras) {
      sensors_.emplace_back(options_.sensor, cv::Size(camera.width(), camera.height()));
    }
    gains_ = controlled_gains(sensors_[0], options_.sensor, means_, 1 / options_.frame_rate);
  }

  void expose(std::size_t frame, int camera) const {
    const double light = flicker_factor(lighting(frame), seconds(frame), options_.seed);
    const auto seed = hash_seed(options_.seed, frame, 20 + static_cast<std::uint64_t>(camera));
    const cv::Mat image =
        sensors_[camera].expose(radiance(frame, camera), light * gains_[frame], seed);
    writer_.add_image(camera, times_[frame], image);
  }

  const SequenceOptions& options_;
  const SimulatedFlight& flight_;
  const SequenceWriter& writer_;
  const RadianceCache& cache_;
  const SimulationProgress& progress_;
  std::vector<Timestamp> times_;
  std::uint64_t common_;
  std::vector<Camera> cameras_;  // as they are, not as their calibration says
  Renderer renderer_;
  std::vector<Sensor> sensors_;
  std::vector<double> means_, gains_;  // of each frame
  std::mutex mutex_;
  std::size_t done_ = 0;
};

void write_inertial_data(SequenceWriter& writer, const SimulatedFlight& flight,
                         const SequenceOptions& options) {
  ReferenceError error = options.reference_error;
  error.seed = hash_seed(options.seed, 0, 40);
  write_imu_folder(writer.add_folder("imu0"), flight.imu, flight.imu_calibration);
  write_ground_truth_folder(writer.add_folder("state_groundtruth_estimate0"), flight.motion,
                            flight.epoch, flight.imu, error);
}

}  // namespace

void SequenceOptions::check() const {
  require(!rig.cameras.empty(), "a rig needs at least one camera");
  require(frame_rate >= 0.1 && frame_rate <= 1000, "--rate {}: must lie between 0.1 and 1000 Hz",
          frame_rate);
  require(calibration_error >= 0 && calibration_error <= 5,
          "--calibration-error {}: must lie between 0 and 5 px", calibration_error);
  require(reference_error.position >= 0 && reference_error.position < 1,
          "--reference-error {}: must lie between 0 and 1000 mm", 1000 * reference_error.position);
  require(lap_frames == 0 || (scene.moving_objects == 0 && lighting != LightingStyle::kSweep),
          "--laps: what moves or changes by itself is not the same in each lap; leave out "
          "--moving-objects and --lighting sweep");
  scene.check();
  render.check();
  sensor.check();
}

std::vector<Timestamp> frame_times(const Motion& motion, Timestamp epoch, double frame_rate) {
  const double length = motion.end() - motion.begin();
  const auto count = static_cast<std::size_t>(std::floor(length * frame_rate + 1e-9)) + 1;
  const auto first = epoch + from_seconds(motion.begin());
  std::vector<Timestamp> times;
  for (std::size_t i = 0; i < count; ++i) {
    times.push_back(first + from_seconds(static_cast<double>(i) / frame_rate));
  }
  return times;
}

void write_sequence(const SequenceOptions& options, const Scene& scene,
                    const SimulatedFlight& flight, ThreadPool& pool,
                    const SimulationProgress& progress) {
  options.check();
  SequenceWriter writer(options.output, options.overwrite);
  const std::filesystem::path own_cache = writer.folder() / "radiance";
  const RadianceCache cache(options.cache.empty() ? own_cache : options.cache);
  ImageProduction images(options, scene, flight, writer, cache, progress);
  writer.add_cameras(options.rig, options.frame_rate, images.times());
  write_inertial_data(writer, flight, options);
  images.run(pool);
  if (options.cache.empty()) std::filesystem::remove_all(own_cache);
  writer.finish();
}

}  // namespace rover
