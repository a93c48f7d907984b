#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rover/features/adaptive_threshold.h"
#include "rover/features/extractor.h"
#include "rover/features/kernels.h"
#include "rover/features/xfeat_graph.h"
#include "rover/networks/runtime.h"

namespace rover {

// What may be set for every extractor; what is not given is the family's own default.
struct ExtractorOptions {
  std::optional<int> radius;        // of the non-maximum suppression, px
  std::optional<float> spread;      // see SelectionOptions
  std::optional<float> mu1, mu2;    // see AdaptiveThresholdOptions
  std::optional<int> min_features;  // likewise
  bool adaptive_threshold = true;
  Precision precision = Precision::kAutomatic;  // of xfeat-corner's network
  const kernels::Kernels* kernels = nullptr;    // null: the best that this machine supports
};

// "xfeat-corner" (default), ...
std::vector<std::string> extractor_names();

// The extractor of a feature family. Throws InputError for an unknown name, or when a model file is
// missing (saying which, where it was looked for and how to make it).
std::unique_ptr<Extractor> make_extractor(const std::string& name, Runtime& runtime,
                                          const ExtractorOptions& options = {});

}  // namespace rover
