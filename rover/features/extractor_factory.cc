#include "rover/features/extractor_factory.h"

#include <fmt/ranges.h>

#include <functional>
#include <map>

#include "rover/base/error.h"
#include "rover/features/aliked_extractor.h"
#include "rover/features/orb_extractor.h"
#include "rover/features/superpoint_extractor.h"
#include "rover/features/xfeat_corner_extractor.h"
#include "rover/features/xfeat_extractor.h"

namespace rover {
namespace {

using Make = std::function<std::unique_ptr<Extractor>(Runtime&, const ExtractorOptions&)>;

void overlay(const ExtractorOptions& given, SelectionOptions& options) {
  AdaptiveThresholdOptions& threshold = options.threshold;
  threshold.enabled = given.adaptive_threshold;
  threshold.mu1 = given.mu1.value_or(threshold.mu1);
  threshold.mu2 = given.mu2.value_or(threshold.mu2);
  threshold.min_features = given.min_features.value_or(threshold.min_features);
  options.spread = given.spread.value_or(options.spread);
}

template <class Function>
Make map_based(Function make, DetectionOptions (*defaults)()) {
  return [=](Runtime& runtime, const ExtractorOptions& given) {
    DetectionOptions options = defaults();
    overlay(given, options.selection);
    options.maxima.radius = given.radius.value_or(options.maxima.radius);
    options.kernels = given.kernels;
    return make(runtime, options);
  };
}

std::unique_ptr<Extractor> make_xfeat_corner(Runtime& runtime, const ExtractorOptions& given) {
  const auto make = [&](Runtime& of, const DetectionOptions& options) {
    return make_xfeat_corner_extractor(of, options, given.precision);
  };
  return map_based(make, xfeat_corner_options)(runtime, given);
}

std::unique_ptr<Extractor> make_orb(Runtime&, const ExtractorOptions& given) {
  OrbOptions options;
  overlay(given, options.selection);
  return make_orb_extractor(options);
}

auto aliked(const std::string& name) {
  return [name](Runtime& runtime, const DetectionOptions& options) {
    return make_aliked_extractor(name, runtime, options);
  };
}

// One line registers an extractor.
const std::map<std::string, Make>& makers() {
  static const std::map<std::string, Make> all = {
      {"xfeat-corner", make_xfeat_corner},
      {"xfeat", map_based(make_xfeat_extractor, xfeat_options)},
      {"aliked-t16", map_based(aliked("aliked-t16"), aliked_options)},
      {"aliked-n16", map_based(aliked("aliked-n16"), aliked_options)},
      {"superpoint", map_based(make_superpoint_extractor, superpoint_options)},
      {"orb", make_orb},
  };
  return all;
}

}  // namespace

std::vector<std::string> extractor_names() {
  std::vector<std::string> names;
  for (const auto& [name, make] : makers()) names.push_back(name);
  return names;
}

std::unique_ptr<Extractor> make_extractor(const std::string& name, Runtime& runtime,
                                          const ExtractorOptions& options) {
  const auto found = makers().find(name);
  require(found != makers().end(), "there are no features named {}; known: {}", name,
          fmt::join(extractor_names(), ", "));
  return found->second(runtime, options);
}

}  // namespace rover
