#include "rover/diagnosis/finding.h"

#include <algorithm>

#include <fmt/format.h>

namespace rover {

const char* to_string(Severity severity) {
  switch (severity) {
    case Severity::kOk:
      return "ok";
    case Severity::kNote:
      return "note";
    case Severity::kWarning:
      break;
  }
  return "warning";
}

Severity worst_of(const Findings& findings) {
  Severity worst = Severity::kOk;
  for (const Finding& finding : findings) worst = std::max(worst, finding.severity);
  return worst;
}

std::string format_vector(const Eigen::Vector3d& vector, int decimals) {
  return fmt::format("({:.{}f}, {:.{}f}, {:.{}f})", vector.x(), decimals, vector.y(), decimals,
                     vector.z(), decimals);
}

void Topic::add(Severity severity, const std::string& name, const std::string& text,
                const std::string& advice, std::optional<double> value) {
  findings_.push_back(
      {severity, name_, name, text, severity == Severity::kOk ? std::string() : advice, value});
}

}  // namespace rover
