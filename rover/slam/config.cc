#include "rover/slam/config.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <variant>

#include <yaml-cpp/yaml.h>

#include "rover/base/error.h"

namespace rover {
namespace {

using Field = std::variant<int*, double*, float*, bool*, std::string*, std::uint64_t*>;
using Fields = std::vector<std::pair<std::string, Field>>;

void add_tracking(TrackerOptions& t, Fields& fields) {
  fields.insert(fields.end(),
                {{"tracking.motion_radius", &t.motion_radius},
                 {"tracking.local_radius", &t.local_radius},
                 {"tracking.confident_inliers", &t.confident_inliers},
                 {"tracking.min_inliers", &t.min_inliers},
                 {"tracking.learned", &t.learned_tracking},
                 {"tracking.refine", &t.refine},
                 {"tracking.max_lost", &t.max_lost},
                 {"tracking.max_lost_young", &t.max_lost_young},
                 {"tracking.min_stereo_points", &t.min_stereo_points},
                 {"tracking.max_view_angle", &t.search.max_view_angle},
                 {"tracking.local_keyframes", &t.local_map.max_keyframes},
                 {"tracking.recent_keyframes", &t.local_map.recent_keyframes},
                 {"tracking.near_keyframes", &t.local_map.near_keyframes},
                 {"tracking.near_distance", &t.local_map.near_distance},
                 {"tracking.near_angle", &t.local_map.near_angle},
                 {"keyframe.min_tracked_share", &t.keyframe.min_tracked_share},
                 {"keyframe.max_parallax", &t.keyframe.max_parallax},
                 {"keyframe.max_rotation", &t.keyframe.max_rotation},
                 {"keyframe.min_landmarks", &t.keyframe.min_landmarks},
                 {"keyframe.min_near", &t.keyframe.min_near},
                 {"keyframe.min_new_near", &t.keyframe.min_new_near},
                 {"keyframe.min_inliers", &t.keyframe.min_inliers},
                 {"keyframe.min_gap", &t.keyframe.min_gap},
                 {"relocalization.min_matches", &t.relocalization.min_matches},
                 {"relocalization.min_inliers", &t.relocalization.min_inliers},
                 {"relocalization.matched_share", &t.relocalization.matched_share},
                 {"relocalization.ransac_sigma", &t.relocalization.ransac_sigma},
                 {"relocalization.recent_keyframes", &t.relocalization.recent_keyframes},
                 {"relocalization.tries_per_frame", &t.relocalization.tries_per_frame},
                 {"initialization.min_features", &t.initialization.min_features},
                 {"initialization.min_matches", &t.initialization.min_matches},
                 {"initialization.min_motion", &t.initialization.min_motion},
                 {"initialization.preview_share", &t.initialization.preview_share},
                 {"initialization.max_pending", &t.initialization.max_pending},
                 {"initialization.max_reference_age", &t.initialization.max_reference_age},
                 {"stereo.max_baselines", &t.stereo.max_baselines},
                 {"stereo.max_relative_sigma", &t.stereo.max_relative_sigma},
                 {"stereo.min_landmarks", &t.stereo.min_landmarks}});
}

void add_mapping(LocalMapperOptions& m, Fields& fields) {
  fields.insert(fields.end(), {{"mapping.neighbours", &m.creation.neighbours},
                               {"mapping.matched_share", &m.creation.matched_share},
                               {"mapping.min_baseline", &m.creation.min_baseline},
                               {"mapping.good_parallax", &m.creation.good_parallax},
                               {"mapping.min_parallax", &m.creation.min_parallax},
                               {"mapping.chi2", &m.creation.chi2},
                               {"mapping.fusion_neighbours", &m.fusion_neighbours},
                               {"mapping.fusion_radius", &m.fusion_radius},
                               {"mapping.window", &m.window},
                               {"mapping.max_fixed", &m.max_fixed},
                               {"mapping.first_iterations", &m.adjustment.first_iterations},
                               {"mapping.second_iterations", &m.adjustment.second_iterations},
                               {"mapping.min_found_share", &m.min_found_share},
                               {"mapping.min_observations", &m.min_observations},
                               {"mapping.probation", &m.probation},
                               {"mapping.redundant_share", &m.redundant_share},
                               {"mapping.kept_images", &m.kept_images}});
}

void add_inertial(Config& c, Fields& fields) {
  InertialTrackingOptions& t = c.tracking.inertial;
  InertialMapperOptions& m = c.mapping.inertial;
  InitializationOptions& i = m.initialization;
  StillnessOptions& s = c.tracking.still;
  fields.insert(fields.end(),
                {{"keyframe.max_gap_waiting", &c.tracking.keyframe.max_gap_waiting},
                 {"keyframe.fading_gap", &c.tracking.keyframe.fading_gap},
                 {"keyframe.max_gap", &c.tracking.keyframe.max_gap},
                 {"keyframe.moving_parallax", &c.tracking.keyframe.moving_parallax},
                 {"keyframe.moving_rotation", &c.tracking.keyframe.moving_rotation},
                 {"mapping.recent_gap", &c.mapping.gaps.recent},
                 {"mapping.old_gap", &c.mapping.gaps.old},
                 {"mapping.settled_after", &c.mapping.gaps.settled},
                 {"still.min_duration", &s.min_duration},
                 {"still.max_pixel_motion", &s.max_pixel_motion},
                 {"still.min_landmarks", &s.min_landmarks},
                 {"still.velocity_sigma", &s.velocity_sigma},
                 {"still.gyroscope", &s.rest.gyroscope},
                 {"still.accelerometer", &s.rest.accelerometer},
                 {"still.gravity", &s.rest.gravity},
                 {"imu.gyroscope_inflation", &t.noise.gyroscope_inflation},
                 {"imu.accelerometer_inflation", &t.noise.accelerometer_inflation},
                 {"imu.gyroscope_walk_inflation", &t.noise.gyroscope_walk_inflation},
                 {"imu.accelerometer_walk_inflation", &t.noise.accelerometer_walk_inflation},
                 {"imu.gap", &t.noise.gap},
                 {"imu.gap_angular_velocity", &t.noise.gap_angular_velocity},
                 {"imu.gap_acceleration", &t.noise.gap_acceleration},
                 {"imu.time_offset", &c.imu_time_offset},
                 {"inertial.position_sigma", &t.position_sigma},
                 {"inertial.rotation_sigma", &t.rotation_sigma},
                 {"inertial.velocity_sigma", &t.velocity_sigma},
                 {"inertial.gyroscope_bias_sigma", &t.gyroscope_bias_sigma},
                 {"inertial.accelerometer_bias_sigma", &t.accelerometer_bias_sigma},
                 {"inertial.min_inliers", &t.min_inliers},
                 {"inertial.min_gap", &t.min_gap},
                 {"inertial.max_dead_reckoning", &t.max_dead_reckoning},
                 {"inertial.max_interval", &t.max_interval},
                 {"inertial.window", &m.window},
                 {"inertial.stereo_window", &m.stereo_window},
                 {"inertial.min_keyframes", &m.min_keyframes},
                 {"inertial.max_keyframes", &m.max_keyframes},
                 {"inertial.max_scale_sigma", &i.max_scale_sigma},
                 {"inertial.max_gravity_sigma", &i.max_gravity_sigma},
                 {"inertial.max_chi2_ratio", &i.max_chi2_ratio},
                 {"inertial.prior_gyroscope_bias", &i.gyroscope_bias_sigma},
                 {"inertial.prior_accelerometer_bias", &i.accelerometer_bias_sigma},
                 {"inertial.first_refinement", &m.first_refinement},
                 {"inertial.refinement_interval", &m.refinement_interval},
                 {"inertial.soonest_refinement", &m.soonest_refinement},
                 {"inertial.max_refined", &m.max_refined},
                 {"inertial.scale_sigma", &m.scale_sigma},
                 {"inertial.max_gyroscope_bias", &m.max_gyroscope_bias},
                 {"inertial.max_accelerometer_bias", &m.max_accelerometer_bias},
                 {"inertial.max_reprojection_ratio", &m.max_reprojection_ratio},
                 {"inertial.max_link_chi2", &m.max_link_chi2},
                 {"inertial.trial_period", &m.trial_period},
                 {"inertial.estimate_time_offset", &m.calibration.time_offset},
                 {"inertial.refine_extrinsics", &m.calibration.extrinsics},
                 {"inertial.prior_time_offset", &m.calibration.prior_time_offset},
                 {"inertial.prior_extrinsic_rotation", &m.calibration.prior_rotation},
                 {"inertial.prior_extrinsic_translation", &m.calibration.prior_translation},
                 {"inertial.max_time_sigma", &m.calibration.max_time_sigma},
                 {"inertial.max_rotation_sigma", &m.calibration.max_rotation_sigma},
                 {"inertial.first_calibration", &m.first_calibration},
                 {"inertial.calibration_interval", &m.calibration_interval},
                 {"inertial.max_calibrated", &m.max_calibrated}});
}

// Every setting by its key. The one list that reading and writing are made from.
Fields fields_of(Config& c) {
  Fields fields = {{"family", &c.family},
                   {"seed", &c.seed},
                   {"threads", &c.runtime.threads},
                   {"mapping_queue", &c.mapping_queue},
                   {"features", &c.frame.features},
                   {"extraction.adaptive", &c.extraction.adaptive},
                   {"extraction.min_features", &c.extraction.min_features},
                   {"extraction.mu1", &c.extraction.mu1},
                   {"extraction.mu2", &c.extraction.mu2},
                   {"extraction.radius", &c.extraction.radius},
                   {"extraction.precision", &c.extraction.precision},
                   {"tracking.matcher", &c.tracking_matcher},
                   {"mapping.matcher", &c.mapping_matcher},
                   {"model_sigma", &c.weighting.model_sigma},
                   {"refinement.half_window", &c.refinement.half_window},
                   {"refinement.max_iterations", &c.refinement.max_iterations},
                   {"refinement.max_shift", &c.refinement.max_shift},
                   {"refinement.min_correlation", &c.refinement.min_correlation},
                   {"refinement.min_sigma", &c.refinement.min_sigma},
                   {"stereo.min_similarity", &c.frame.stereo.min_similarity},
                   {"stereo.epipolar_gate", &c.frame.stereo.epipolar_gate},
                   {"stereo.min_depth", &c.frame.stereo.min_depth},
                   {"stereo.max_depth", &c.frame.stereo.max_depth},
                   {"stereo.refine", &c.frame.stereo.refine},
                   {"final.first_iterations", &c.final_adjustment.first_iterations},
                   {"final.second_iterations", &c.final_adjustment.second_iterations},
                   {"final.max_inertial_keyframes", &c.max_finally_adjusted}};
  add_tracking(c.tracking, fields);
  add_mapping(c.mapping, fields);
  add_inertial(c, fields);
  return fields;
}

// One file being read; knows where it is for error messages.
class ConfigReader {
 public:
  ConfigReader(std::string file, Config& config) : file_(std::move(file)) {
    for (const auto& [key, field] : fields_of(config)) fields_.emplace(key, field);
  }

  void read(const YAML::Node& node, const std::string& prefix) {
    for (const auto& item : node) {
      const std::string key = prefix + item.first.as<std::string>();
      if (item.second.IsMap()) {
        read(item.second, key + ".");
      } else {
        set(key, item.first, item.second);
      }
    }
  }

 private:
  void set(const std::string& key, const YAML::Node& name, const YAML::Node& value) {
    const auto field = fields_.find(key);
    if (field == fields_.end()) {
      throw InputError("{}:{}: unknown key '{}'; docs/configuration.md lists the known ones", file_,
                       name.Mark().line + 1, key);
    }
    std::visit([&](auto* target) { assign(key, value, *target); }, field->second);
  }

  template <class T>
  void assign(const std::string& key, const YAML::Node& value, T& target) const {
    T read{};
    if (!value.IsScalar() || !YAML::convert<T>::decode(value, read) || !is_finite(read)) {
      throw InputError("{}:{}: '{}' must be {}, not '{}'", file_, value.Mark().line + 1, key,
                       kind_of(read), value.IsScalar() ? value.Scalar() : "a list or nothing");
    }
    target = read;
  }

  template <class T>
  static bool is_finite(const T& value) {
    if constexpr (std::is_floating_point_v<T>) return std::isfinite(value);
    return true;
  }
  static const char* kind_of(int) { return "a whole number"; }
  static const char* kind_of(std::uint64_t) { return "a whole number that is not negative"; }
  static const char* kind_of(double) { return "a number"; }
  static const char* kind_of(bool) { return "true or false"; }
  static const char* kind_of(const std::string&) { return "a word"; }

  std::string file_;
  std::map<std::string, Field> fields_;
};

template <class T>
std::string as_text(const T& value) {
  if constexpr (std::is_same_v<T, std::string>) {
    return value;
  } else {
    return fmt::format("{}", value);
  }
}

YAML::Node parse_file(const std::filesystem::path& file) {
  try {
    return YAML::LoadFile(file.string());
  } catch (const YAML::BadFile&) {
    throw InputError("{}: cannot be read; give --config an existing YAML file", file.string());
  } catch (const YAML::ParserException& error) {
    throw InputError("{}:{}: not valid YAML: {}", file.string(), error.mark.line + 1, error.msg);
  }
}

Precision parse_precision(const std::string& name) {
  if (name == "automatic") return Precision::kAutomatic;
  if (name == "float") return Precision::kFloat;
  if (name == "int8") return Precision::kInt8;
  throw InputError("extraction.precision is '{}'; use automatic, float or int8", name);
}

}  // namespace

Config::Config() {
  final_adjustment.first_iterations = 20;
  final_adjustment.second_iterations = 50;
}

void ExtractionConfig::check() const {
  parse_precision(precision);
  require(min_features >= 0, "extraction.min_features is {}; use 0 or more", min_features);
  require(radius >= 0 && radius <= 50, "extraction.radius is {}; use 0 to 50 px", radius);
}

ExtractorOptions ExtractionConfig::options() const {
  ExtractorOptions options;
  options.adaptive_threshold = adaptive;
  options.min_features = min_features;
  options.mu1 = static_cast<float>(mu1);
  options.mu2 = static_cast<float>(mu2);
  if (radius > 0) options.radius = radius;
  options.precision = parse_precision(precision);
  return options;
}

void Config::check() const {
  extraction.check();
  runtime.check();
  require(std::abs(imu_time_offset) < 1, "imu.time_offset is {}; use -1 to 1 s", imu_time_offset);
  require(max_finally_adjusted > 1, "final.max_inertial_keyframes is {}; use 2 or more",
          max_finally_adjusted);
  require(mapping_queue > 0, "mapping_queue is {}; use 1 or more", mapping_queue);
  for (const std::string& matcher : {tracking_matcher, mapping_matcher}) {
    require(std::ranges::count(matcher_names(), matcher) > 0,
            "unknown matcher '{}'; use learned or classical", matcher);
  }
  weighting.check();
  refinement.check();
  frame.check();
  tracking.check();
  mapping.check();
  final_adjustment.check();
}

void Config::distribute(const GuidedMatchingOptions& guided) {
  tracking.weighting = weighting;
  tracking.refinement = refinement;
  tracking.search.guided = guided;
  mapping.creation.weighting = weighting;
  mapping.creation.refinement = refinement;
}

void load_config(const std::filesystem::path& file, Config& config) {
  const YAML::Node root = parse_file(file);
  if (root.IsNull()) return;
  if (!root.IsMap()) {
    throw InputError("{}: must hold 'key: value' lines; see docs/configuration.md", file.string());
  }
  Config changed = config;
  ConfigReader(file.string(), changed).read(root, "");
  try {
    changed.check();
  } catch (const InputError& error) {
    throw InputError("{}: {}", file.string(), error.what());
  }
  config = changed;
}

std::vector<std::pair<std::string, std::string>> list_config(const Config& config) {
  Config copy = config;
  std::vector<std::pair<std::string, std::string>> result;
  for (const auto& [key, field] : fields_of(copy)) {
    result.emplace_back(key, std::visit([](const auto* value) { return as_text(*value); }, field));
  }
  return result;
}

}  // namespace rover
