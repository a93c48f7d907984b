#pragma once

#include <memory>

#include "rover/features/detection.h"
#include "rover/features/extractor.h"
#include "rover/networks/runtime.h"

namespace rover {

// Suppression radius 4 and border 4 as its authors have it; a lower floor, for the dark.
DetectionOptions superpoint_options();

// SuperPoint (DeTone et al., CVPRW 2018); positions refined by the centre of mass over 5x5.
// Descriptors have 256 elements. Needs superpoint.onnx, which a user makes from the official
// weights: their licence forbids passing them on.
std::unique_ptr<Extractor> make_superpoint_extractor(Runtime& runtime,
                                                     const DetectionOptions& options);

}  // namespace rover
