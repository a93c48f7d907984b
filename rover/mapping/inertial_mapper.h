#pragma once

#include <functional>
#include <string>
#include <vector>

#include "rover/map/shared_map.h"
#include "rover/optimization/camera_imu_calibration.h"
#include "rover/optimization/inertial_initialization.h"
#include "rover/optimization/inertial_map_adjustment.h"

namespace rover {

struct InertialMapperOptions {
  int window = 10;         // keyframes in time, mono: free in the local adjustment
  int stereo_window = 15;  // likewise, stereo
  InitializationOptions initialization{};
  CalibrationOptions calibration{};  // off
  int min_keyframes = 6;             // linked in time before initialisation is tried
  int max_keyframes = 80;            // the newest so many take part in it
  double first_refinement = 5;       // s after initialisation: all states are adjusted, ...
  double refinement_interval = 10;   // ... and again after so many s
  // Until the scale is known to this they are adjusted more often, first so many s after
  // initialisation, later each time when half as long again has passed since then.
  double scale_sigma = 0.015;
  double soonest_refinement = 1;
  int max_refined = 80;  // the newest keyframes that are; older ones move along
  // Calibration, where asked for: s after initialisation, and again after so many s (ever longer)
  // until it settles, from the newest keyframes.
  double first_calibration = 5;
  double calibration_interval = 5;
  int max_calibrated = 80;
  // An initialisation is undone, or not even done, if ...
  double max_gyroscope_bias = 0.5;      // rad/s
  double max_accelerometer_bias = 1.5;  // m/s^2
  double max_reprojection_ratio = 1.2;  // inertial data make the reprojection error grow by more
  double max_link_chi2 = 90;            // mean over the window, of 9 degrees of freedom, ...
  double trial_period = 3;              // ... in the first s
  // At initialisation, at its refinements, and without inertial data where it is undone.
  BundleOptions adjustment{
      .first_iterations = 10, .second_iterations = 10, .min_relative_decrease = 1e-5};

  void check() const;
};

enum class InertialEvent { kNone, kInitialized, kRefined, kCalibrated, kUndone };

// What the inertial part of mapping did with one keyframe.
struct InertialReport {
  InertialEvent event = InertialEvent::kNone;
  double scale_sigma = 0;  // relative; where it was estimated
  std::string waiting;     // before initialisation: what is missing, in plain words
};

// The part of mapping that inertial data make possible: initialisation, its refinements, and the
// visual-inertial local adjustment.
class InertialMapper {
 public:
  InertialMapper(const InertialMapperOptions& options, const WeightingOptions& weighting);

  // Adjusts the last keyframes in time; for aligned maps. An initialisation that turns out wrong is
  // undone: the map is a visual one again, and what it has seen so far takes no part in the next
  // initialisation.
  InertialReport adjust_window(SharedMap& map, KeyframeId keyframe, int max_fixed,
                               const BundleOptions& options) const;

  // Aligns a map as soon as its keyframes allow, later calibrates (where asked for) and refines it.
  InertialReport advance(SharedMap& map, KeyframeId keyframe) const;

 private:
  // An alignment tried on a copy of a map. Empty `missing`: it holds.
  struct Trial {
    InitializationResult alignment;
    InertialMapProblem problem;
    InertialBundleSummary summary;
    double scale_sigma = 0;
    std::string missing;
  };
  Trial try_alignment(Map map, const std::vector<KeyframeId>& chain) const;
  void shift_coarsely(SharedMap& map, KeyframeId keyframe) const;
  bool needs_calibration(const Map& map, Timestamp now) const;
  InertialReport calibrate(SharedMap& map, KeyframeId keyframe) const;
  InertialReport apply(SharedMap& map, KeyframeId keyframe, const CalibrationResult& result) const;
  InertialReport initialize(SharedMap& map, KeyframeId keyframe) const;
  InertialReport refine(SharedMap& map, KeyframeId keyframe) const;
  InertialReport undo(SharedMap& map, KeyframeId keyframe) const;
  bool needs_refinement(const Map& map, Timestamp now) const;
  bool is_on_trial(const Map& map, KeyframeId keyframe) const;
  bool is_plausible(const InertialMapProblem& problem, const InertialBundleSummary& summary) const;
  bool is_certain(double scale_sigma) const;
  bool is_settled(const Map& map, double scale_sigma) const;
  bool is_bent(const InertialBundleSummary& summary, const BundleSummary& visual) const;

  InertialMapperOptions options_;
  WeightingOptions weighting_;
};

}  // namespace rover
