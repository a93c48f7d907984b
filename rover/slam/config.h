#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "rover/mapping/local_mapper.h"
#include "rover/networks/runtime.h"
#include "rover/tracking/frame_builder.h"
#include "rover/tracking/tracker.h"

namespace rover {

// How features are chosen; see features/adaptive_threshold.h and features/selection.h.
struct ExtractionConfig {
  bool adaptive = true;    // the paper's threshold; else the best up to the budget
  int min_features = 500;  // this many best candidates pass, however high the threshold is;
                           // for 640x480, other sizes in proportion (as `features`)
  double mu1 = 0.25;       // standard deviations of the score
  double mu2 = 0.02;       // per match of the last frame
  std::string precision = "automatic";  // of xfeat-corner's network: automatic, float, int8
  int radius = 0;                       // px, of the non-maximum suppression; 0: the family's own

  void check() const;
  ExtractorOptions options() const;
};

enum class Execution {
  kLockstep,    // mapping of a keyframe ends before the next frame is tracked: reproducible
  kConcurrent,  // mapping runs on a thread of its own
};

// What stereo-inertial mode has in place of the others' values. Not monocular-inertial: what vision
// says more sharply there, of a map's shape, leaves slow errors of inertial data no way out but the
// scale (docs/results.md).
struct StereoInertialConfig {
  // BundleOptions::huber, of mapping's and the final adjustments. Most observations are off by far
  // less than the weighting says, some by far more that are no outliers yet (features on outlines,
  // patches seen at an angle): close to least deviations, the many are not pulled by the few.
  double huber = 0.6;
  // WeightingOptions, of all stages; gates scale with them. Between the median and the tail of what
  // observations are off by (docs/matching.md).
  double model_sigma = 0.3, detection_sigma = 0.8;  // px

  void check() const;
};

// Everything that can be set, with the defaults that docs/results.md was made with. Written as
// YAML: see docs/configuration.md for the keys.
struct Config {
  std::string family = "xfeat-corner";
  std::uint64_t seed = 1;
  RuntimeOptions runtime;
  Execution execution = Execution::kLockstep;
  int mapping_queue = 8;                     // keyframes that may wait for mapping (concurrent)
  std::string tracking_matcher = "learned";  // see matcher_names(): of initialisation, tracking
  std::string mapping_matcher = "learned";   // and relocalisation; of mapping
  double imu_time_offset = 0;  // s: time of the inertial clock = time of the cameras' + offset
  WeightingOptions weighting;  // used by all stages
  PatchRefinementOptions refinement;  // likewise
  ExtractionConfig extraction;
  FrameBuilderOptions frame;
  TrackerOptions tracking;
  LocalMapperOptions mapping;
  BundleOptions final_adjustment;
  StereoInertialConfig stereo_inertial;
  // Of larger inertial maps the newest so many keyframes are adjusted at the end, and older ones
  // move along: memory goes with the square of their number, 0.2 GB for 300.
  int max_finally_adjusted = 300;

  Config();
  void check() const;
  // Hands the options that several stages share, and the family's thresholds, to each stage.
  void distribute(const GuidedMatchingOptions& guided, bool is_stereo_inertial);
};

// Sets what a YAML file says; other settings stay. Unknown keys, values of the wrong kind and
// values that make no sense are errors (InputError) that name the file and the line.
void load_config(const std::filesystem::path& file, Config& config);

// All keys with their values as text, in the order of the file format.
std::vector<std::pair<std::string, std::string>> list_config(const Config& config);

}  // namespace rover
