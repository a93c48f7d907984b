#pragma once

#include <memory>
#include <string>
#include <vector>

#include "rover/features/extractor.h"
#include "rover/features/extractor_factory.h"
#include "rover/matching/guided_matching.h"
#include "rover/matching/matcher.h"
#include "rover/networks/runtime.h"

namespace rover {

// An extractor with the matcher that belongs to its descriptor, and what similarity means for it.
struct FeatureFamily {
  std::string name;
  std::shared_ptr<const Extractor> extractor;
  std::shared_ptr<const Matcher> matcher;    // learned, where there is one for the descriptor
  std::shared_ptr<const Matcher> classical;  // mutual nearest neighbours
  GuidedMatchingOptions guided;              // thresholds measured for this descriptor
};

// "learned" (the family's own matcher) or "classical", for comparisons.
const std::vector<std::string>& matcher_names();

// The same family with the matcher of that name. Throws InputError for an unknown one.
FeatureFamily with_matcher(FeatureFamily family, const std::string& name);

// "xfeat-corner" (default), "xfeat", "aliked-t16", "aliked-n16", "superpoint", "orb". A new family
// is one file that registers itself here.
std::vector<std::string> feature_family_names();

// Throws InputError for an unknown name or when a model file is missing (saying which, where it was
// looked for and how to make it).
FeatureFamily make_feature_family(const std::string& name, Runtime& runtime,
                                  const ExtractorOptions& extraction = {});

}  // namespace rover
