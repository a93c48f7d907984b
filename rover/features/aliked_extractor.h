#pragma once

#include <memory>
#include <string>

#include "rover/features/detection.h"
#include "rover/features/extractor.h"
#include "rover/networks/runtime.h"

namespace rover {

// Suppression radius 2 as its authors have it.
DetectionOptions aliked_options();

// ALIKED (Zhao et al., IEEE TIM 2023), `name` "aliked-t16" (descriptors of 64 elements) or
// "aliked-n16" (128). Positions by soft-argmax over 5x5 at temperature 0.1. The graphs are run as
// docs/networks.md says; joint vectors are only made where descriptors need them.
std::unique_ptr<Extractor> make_aliked_extractor(const std::string& name, Runtime& runtime,
                                                 const DetectionOptions& options);

}  // namespace rover
