#pragma once

#include <memory>

#include "rover/features/detection.h"
#include "rover/features/extractor.h"
#include "rover/features/xfeat_graph.h"
#include "rover/networks/runtime.h"

namespace rover {

// Suppression 9x9; the floor is a response that sensor noise alone makes.
DetectionOptions xfeat_corner_options();

// Corners that XFeat finds reliable, with XFeat's descriptors (DESIGN, section 4): the learned
// reliability decides which corners, the structure tensor where they are, the learned map what they
// look like. Score: square root of the smaller eigenvalue of the structure tensor (gray levels per
// px) times reliability (0 to 1). Descriptors have 64 elements.
//
// Sources: Shi and Tomasi, Good Features to Track, CVPR 1994; Potje et al., XFeat, CVPR 2024.
std::unique_ptr<Extractor> make_xfeat_corner_extractor(Runtime& runtime,
                                                       const DetectionOptions& options,
                                                       Precision precision = Precision::kAutomatic);

}  // namespace rover
