#pragma once

#include <memory>

#include "rover/features/extractor.h"
#include "rover/features/local_maxima.h"
#include "rover/features/selection.h"
#include "rover/networks/runtime.h"

namespace rover {

struct XFeatCornerOptions {
  // floor and low: a response that sensor noise alone makes (gray levels per px).
  MaximaOptions maxima{.radius = 4, .border = 6, .floor = 0.1f};
  SelectionOptions selection;
  const kernels::Kernels* kernels = nullptr;  // null: the best that this machine supports

  void check() const;
};

// Corners that XFeat finds reliable, with XFeat's descriptors (DESIGN, section 4): the learned
// reliability decides which corners, the structure tensor where they are, the learned map what they
// look like. Score: square root of the smaller eigenvalue of the structure tensor (gray levels per
// px) times reliability (0 to 1). Descriptors have 64 elements.
//
// Sources: Shi and Tomasi, Good Features to Track, CVPR 1994; Potje et al., XFeat, CVPR 2024.
std::unique_ptr<Extractor> make_xfeat_corner_extractor(Runtime& runtime,
                                                       const XFeatCornerOptions& options = {});

}  // namespace rover
