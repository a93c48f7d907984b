#include "rover/slam/mode.h"

#include "rover/base/error.h"

namespace rover {

Mode parse_mode(const std::string& name) {
  if (name == "mono") return Mode::kMono;
  if (name == "stereo") return Mode::kStereo;
  throw InputError("mode '{}' is not known; use mono or stereo", name);
}

const char* to_string(Mode mode) { return mode == Mode::kMono ? "mono" : "stereo"; }

}  // namespace rover
