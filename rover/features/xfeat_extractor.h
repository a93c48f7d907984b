#pragma once

#include <memory>

#include "rover/features/detection.h"
#include "rover/features/extractor.h"
#include "rover/networks/runtime.h"

namespace rover {

// Suppression 5x5 of the heat map, heat above 0.05, as its authors have it.
DetectionOptions xfeat_options();

// XFeat with its own keypoint head (Potje et al., CVPR 2024): score = heat map times reliability,
// positions refined by a parabola through the heat. Descriptors have 64 elements.
std::unique_ptr<Extractor> make_xfeat_extractor(Runtime& runtime, const DetectionOptions& options);

}  // namespace rover
