#pragma once

#include <filesystem>
#include <functional>
#include <limits>

#include "rover/simulation/imu_synthesis.h"
#include "rover/simulation/inertial_files.h"
#include "rover/simulation/motion.h"
#include "rover/simulation/renderer.h"
#include "rover/simulation/scene_factory.h"
#include "rover/simulation/sensor.h"

namespace rover {

struct SequenceOptions {
  std::filesystem::path output;
  bool overwrite = false;
  std::filesystem::path cache;  // for noise-free images; empty: they are not kept
  Rig rig;                      // in the body frame
  SceneOptions scene;
  RenderOptions render;
  LightingStyle lighting = LightingStyle::kConstant;
  SensorOptions sensor;
  double lighting_until = std::numeric_limits<double>::infinity();  // s; constant from then on
  double frame_rate = 20;                                           // Hz
  // The flight repeats itself after so many frames, so only those are rendered; 0: it does not.
  std::size_t lap_frames = 0;
  // How far the delivered calibration is off, px: 0 is exact. See disturbed_camera.
  double calibration_error = 0;
  ReferenceError reference_error;  // of the ground truth that is written; its seed is not used
  std::uint64_t seed = 0;          // of the sensor's noise and the flicker

  // Throws InputError for values that make no sense.
  void check() const;
};

// What moves through the scene and what its inertial sensor reads. Seconds 0 of the motion is at
// `epoch`.
struct SimulatedFlight {
  const Motion& motion;
  Timestamp epoch = 0;
  const ImuRecording& imu;
  ImuCalibration imu_calibration;
};

// Told after each step how many of how many are done, from any thread but one at a time.
using SimulationProgress = std::function<void(std::size_t, std::size_t)>;

// Mid-exposure stamps: from the motion's begin to its end.
std::vector<Timestamp> frame_times(const Motion& motion, Timestamp epoch, double frame_rate);

// Renders a flight through a scene (first without noise, into the cache) and writes images,
// inertial data and ground truth in EuRoC's layout. The same bytes for the same input, whatever the
// number of threads.
void write_sequence(const SequenceOptions& options, const Scene& scene,
                    const SimulatedFlight& flight, ThreadPool& pool,
                    const SimulationProgress& progress);

}  // namespace rover
