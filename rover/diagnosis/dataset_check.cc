#include "rover/diagnosis/dataset_check.h"

#include <algorithm>

#include "rover/base/error.h"
#include "rover/diagnosis/calibration_check.h"
#include "rover/diagnosis/clock_check.h"
#include "rover/diagnosis/image_check.h"
#include "rover/diagnosis/inertial_check.h"
#include "rover/diagnosis/visual_motion.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

Config visual_config(const DatasetCheckOptions& options) {
  Config config;
  config.family = options.family;
  config.runtime.threads = options.threads;
  config.frame.features = options.features;
  config.extraction.min_features = std::min(config.extraction.min_features, options.features / 2);
  return config;
}

void check_seen(const DatasetSurvey& survey, const DatasetCheckOptions& options,
                Findings& findings) {
  const Config config = visual_config(options);
  Runtime runtime(config.runtime);
  const FeatureFamily family =
      make_feature_family(options.family, runtime, config.extraction.options());
  const SampledFeatures features = extract_samples(survey.samples, family, options.features);
  if (survey.stereo()) check_stereo(survey.rig, survey.samples, features, family, findings);
  check_images(survey.samples, features, findings);
}

void check_joint(const DatasetOptions& input, const DatasetSurvey& survey,
                 const DatasetCheckOptions& options, Findings& findings) {
  const auto span = liveliest_span(survey.times, survey.imu, options.visual_run);
  const Trajectory camera =
      span ? visual_motion(input, *span, visual_config(options)) : Trajectory();
  check_camera_against_imu(camera, survey.rig.body_from_camera[0].rotation, survey.imu, findings);
}

}  // namespace

void DatasetCheckOptions::check() const {
  require(samples > 0 && samples <= 1000, "check: samples is {}; use 1 to 1000", samples);
  require(visual_run > 0 && visual_run <= 600, "check: visual_run is {} s; use up to 600",
          visual_run);
  require(features >= 50, "check: features is {}; use 50 or more", features);
  require(threads > 0, "check: threads must be positive, not {}", threads);
}

DatasetOptions with_all_sensors(DatasetOptions input) {
  const fs::path root = fs::is_directory(input.path / "mav0") ? input.path / "mav0" : input.path;
  input.stereo = fs::is_directory(root / "cam1") || fs::is_directory(root / "image_1");
  input.inertial = fs::is_directory(root / "imu0");
  return input;
}

Findings check_dataset(const DatasetOptions& input, const DatasetCheckOptions& options) {
  options.check();
  Findings findings;
  const auto dataset = open_dataset(input);
  const DatasetSurvey survey = survey_dataset(*dataset, options.samples);
  check_calibration(survey.rig, input.inertial, findings);
  check_seen(survey, options, findings);
  check_clocks(survey, findings);
  if (!input.inertial) return findings;
  check_inertial_data(survey.imu, survey.imu_calibration.value_or(ImuCalibration()), findings);
  check_joint(input, survey, options, findings);
  return findings;
}

}  // namespace rover
