#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "rover/slam/config.h"

namespace rover {

using ConfigField = std::variant<int*, double*, float*, bool*, std::string*, std::uint64_t*>;
using ConfigFields = std::vector<std::pair<std::string, ConfigField>>;

// Every setting of a configuration by its key, in the order of the file format: the one list that
// reading and writing are made from. The pointers are as long-lived as the configuration.
ConfigFields fields_of(Config& config);

}  // namespace rover
