#pragma once

#include <string>

namespace rover {

enum class Mode { kMono, kStereo, kMonoInertial, kStereoInertial };

// "mono", "stereo", "mono-inertial", "stereo-inertial". Throws InputError for others.
Mode parse_mode(const std::string& name);
const char* to_string(Mode mode);

inline bool is_stereo(Mode mode) { return mode == Mode::kStereo || mode == Mode::kStereoInertial; }
inline bool is_inertial(Mode mode) {
  return mode == Mode::kMonoInertial || mode == Mode::kStereoInertial;
}

}  // namespace rover
