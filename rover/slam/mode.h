#pragma once

#include <string>

namespace rover {

enum class Mode { kMono, kStereo };

// "mono", "stereo". Throws InputError for others.
Mode parse_mode(const std::string& name);
const char* to_string(Mode mode);

}  // namespace rover
