#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "rover/diagnosis/finding.h"

namespace rover {

// Names of what was warned of, in order.
inline std::vector<std::string> warnings_of(const Findings& findings) {
  std::vector<std::string> names;
  for (const Finding& finding : findings)
    if (finding.severity == Severity::kWarning) names.push_back(finding.name);
  return names;
}

// The finding of that name; an empty one if there is none.
inline Finding find_finding(const Findings& findings, const std::string& name) {
  const auto found = std::find_if(findings.begin(), findings.end(),
                                  [&](const Finding& finding) { return finding.name == name; });
  return found == findings.end() ? Finding() : *found;
}

}  // namespace rover
