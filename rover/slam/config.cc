#include "rover/slam/config.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <yaml-cpp/yaml.h>

#include "rover/base/error.h"
#include "rover/slam/config_fields.h"

namespace rover {
namespace {

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
  std::map<std::string, ConfigField> fields_;
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

void StereoInertialConfig::check() const {
  require(huber > 0, "inertial.stereo_huber is {}; use a number above 0", huber);
  require(model_sigma >= 0 && model_sigma < 100,
          "inertial.stereo_model_sigma is {}; use 0 to 100 px", model_sigma);
  require(detection_sigma >= 0 && detection_sigma < 100,
          "inertial.stereo_detection_sigma is {}; use 0 to 100 px", detection_sigma);
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
  stereo_inertial.check();
  weighting.check();
  refinement.check();
  frame.check();
  tracking.check();
  mapping.check();
  final_adjustment.check();
}

void Config::distribute(const GuidedMatchingOptions& guided, bool is_stereo_inertial) {
  WeightingOptions used = weighting;
  if (is_stereo_inertial) {
    used.model_sigma = stereo_inertial.model_sigma;
    used.detection_sigma = stereo_inertial.detection_sigma;
    mapping.adjustment.huber = stereo_inertial.huber;
    mapping.inertial.adjustment.huber = stereo_inertial.huber;
    final_adjustment.huber = stereo_inertial.huber;
  }
  tracking.weighting = used;
  tracking.refinement = refinement;
  tracking.search.guided = guided;
  mapping.creation.weighting = used;
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
