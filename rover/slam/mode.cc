#include "rover/slam/mode.h"

#include <array>

#include "rover/base/error.h"

namespace rover {
namespace {

constexpr std::array kModes = {Mode::kMono, Mode::kStereo, Mode::kMonoInertial,
                               Mode::kStereoInertial};

}  // namespace

Mode parse_mode(const std::string& name) {
  for (const Mode mode : kModes) {
    if (name == to_string(mode)) return mode;
  }
  throw InputError("mode '{}' is not known; use mono, stereo, mono-inertial or stereo-inertial",
                   name);
}

const char* to_string(Mode mode) {
  switch (mode) {
    case Mode::kMono:
      return "mono";
    case Mode::kStereo:
      return "stereo";
    case Mode::kMonoInertial:
      return "mono-inertial";
    case Mode::kStereoInertial:
      return "stereo-inertial";
  }
  return "";
}

}  // namespace rover
