#pragma once

#include <string>

#include "rover/networks/runtime.h"

namespace rover {

enum class Precision { kAutomatic, kFloat, kInt8 };

// File name of XFeat's graph. Automatic: 8-bit arithmetic where the processor multiplies and adds
// bytes in one instruction: a third of the time for the same matches (docs/networks.md). Elsewhere
// float: older x86 processors saturate intermediate sums and gain little, and accelerators have no
// 8-bit graph of this kind.
std::string xfeat_graph(Precision precision, Device device);

}  // namespace rover
