#include "rover/features/extractor_factory.h"

#include <fmt/ranges.h>

#include <functional>
#include <map>

#include "rover/base/error.h"
#include "rover/features/xfeat_corner_extractor.h"

namespace rover {
namespace {

using Make = std::function<std::unique_ptr<Extractor>(Runtime&, const ExtractorOptions&)>;

// An extractor's own options with those given laid over them.
template <class Options>
Options overlay(Options options, const ExtractorOptions& given) {
  AdaptiveThresholdOptions& threshold = options.selection.threshold;
  threshold.enabled = given.adaptive_threshold;
  threshold.mu1 = given.mu1.value_or(threshold.mu1);
  threshold.mu2 = given.mu2.value_or(threshold.mu2);
  threshold.min_features = given.min_features.value_or(threshold.min_features);
  options.selection.spread = given.spread.value_or(options.selection.spread);
  options.maxima.radius = given.radius.value_or(options.maxima.radius);
  return options;
}

template <class Options>
Make maker(std::unique_ptr<Extractor> (*make)(Runtime&, const Options&)) {
  return [make](Runtime& runtime, const ExtractorOptions& given) {
    return make(runtime, overlay(Options{}, given));
  };
}

// One line registers an extractor.
const std::map<std::string, Make>& makers() {
  static const std::map<std::string, Make> all = {
      {"xfeat-corner", maker(make_xfeat_corner_extractor)},
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
