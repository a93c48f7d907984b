#pragma once

#include <memory>

#include "rover/features/extractor.h"
#include "rover/features/selection.h"

namespace rover {

struct OrbOptions {
  int levels = 8;
  float scale = 1.2f;      // between levels
  int fast_threshold = 7;  // gray levels
  SelectionOptions selection;

  void check() const;
};

// ORB as OpenCV has it (Rublee et al., ICCV 2011), the classical baseline. Score: fourth root of
// Harris' measure, which grows like contrast. The 256 bits are elements +-1/16, so that a dot
// product is 1 - 2 (Hamming distance) / 256. A position is as uncertain as its level is coarse.
std::unique_ptr<Extractor> make_orb_extractor(const OrbOptions& options);

}  // namespace rover
