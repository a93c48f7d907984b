#include "rover/matching/feature_family.h"

#include <algorithm>

#include <fmt/ranges.h>

#include "rover/base/error.h"
#include "rover/matching/lightglue_matcher.h"
#include "rover/matching/mutual_nearest_neighbour.h"

namespace rover {
namespace {

using MatcherMaker = std::shared_ptr<const Matcher> (*)(Runtime& runtime);

struct FamilyEntry {
  const char* name;
  MatcherMaker make_matcher;
  GuidedMatchingOptions guided;
};

std::shared_ptr<const Matcher> make_lighterglue(Runtime& runtime) {
  return std::make_shared<LightGlueMatcher>(runtime, lighterglue_options());
}

std::shared_ptr<const Matcher> make_aliked_lightglue(Runtime& runtime) {
  return std::make_shared<LightGlueMatcher>(runtime, lightglue_options("lightglue-aliked-n16"));
}

// The least similarity of ALIKED's and SuperPoint's pairs, measured over wide baselines
// (docs/matching.md): without it half of the matches are wrong.
std::shared_ptr<const Matcher> make_mutual(Runtime&) {
  return std::make_shared<MutualNearestNeighbourMatcher>(
      MutualNearestNeighbourOptions{.min_similarity = 0.6f, .max_ratio = 1});
}

// Binary descriptors are only distinct by comparison. 0.9 of the distance is 0.81 of the bits.
std::shared_ptr<const Matcher> make_mutual_with_ratio(Runtime&) {
  return std::make_shared<MutualNearestNeighbourMatcher>(
      MutualNearestNeighbourOptions{.min_similarity = 0, .max_ratio = 0.9f});
}

// SuperPoint's LightGlue may not be passed on: users without it match by nearest neighbour.
std::shared_ptr<const Matcher> make_superpoint_matcher(Runtime& runtime) {
  const LightGlueOptions options = lightglue_options("lightglue-superpoint");
  try {
    runtime.find(options.model + "_input.onnx");
  } catch (const InputError&) {
    return make_mutual(runtime);
  }
  return std::make_shared<LightGlueMatcher>(runtime, options);
}

// Thresholds: docs/matching.md, guided matching.
constexpr FamilyEntry kFamilies[] = {
    {"xfeat-corner", make_lighterglue, {.min_similarity = 0.82f, .max_ratio = 0.9f}},
    {"xfeat", make_lighterglue, {.min_similarity = 0.82f, .max_ratio = 0.85f}},
    {"aliked-t16", make_mutual, {.min_similarity = 0.65f, .max_ratio = 0.9f}},
    {"aliked-n16", make_aliked_lightglue, {.min_similarity = 0.65f, .max_ratio = 0.9f}},
    {"superpoint", make_superpoint_matcher, {.min_similarity = 0.75f, .max_ratio = 0.9f}},
    {"orb", make_mutual_with_ratio, {.min_similarity = 0.6f, .max_ratio = 0.9f}},
};

}  // namespace

std::vector<std::string> feature_family_names() {
  std::vector<std::string> names;
  for (const FamilyEntry& family : kFamilies) names.emplace_back(family.name);
  return names;
}

FeatureFamily make_feature_family(const std::string& name, Runtime& runtime,
                                  const ExtractorOptions& extraction) {
  const auto* entry = std::ranges::find_if(
      kFamilies, [&](const FamilyEntry& family) { return name == family.name; });
  require(entry != std::end(kFamilies), "unknown feature family '{}'; there are: {}", name,
          fmt::join(feature_family_names(), ", "));
  const MutualNearestNeighbourOptions classical{.min_similarity = entry->guided.min_similarity,
                                                .max_ratio = entry->guided.max_ratio};
  return {name, make_extractor(name, runtime, extraction), entry->make_matcher(runtime),
          std::make_shared<MutualNearestNeighbourMatcher>(classical), entry->guided};
}

const std::vector<std::string>& matcher_names() {
  static const std::vector<std::string> names = {"learned", "classical"};
  return names;
}

FeatureFamily with_matcher(FeatureFamily family, const std::string& name) {
  require(std::ranges::count(matcher_names(), name) > 0, "unknown matcher '{}'; there are: {}",
          name, fmt::join(matcher_names(), ", "));
  if (name == "classical") family.matcher = family.classical;
  return family;
}

}  // namespace rover
