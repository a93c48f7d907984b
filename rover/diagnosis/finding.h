#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace rover {

enum class Severity {
  kOk,
  kNote,     // worth knowing; nothing to mend
  kWarning,  // will spoil results or fail a run
};

// "ok", "note", "warning".
const char* to_string(Severity severity);

// One thing that was looked at.
struct Finding {
  Severity severity = Severity::kOk;
  std::string topic;            // "calibration", "clocks", "images", "imu" ...
  std::string name;             // of the thing, for machines: "time_offset"
  std::string text;             // what was found, in plain words with units
  std::string advice;           // what to do; empty where all is well
  std::optional<double> value;  // the figure that was judged, in the unit that `text` gives
};

using Findings = std::vector<Finding>;

// kOk for no findings.
Severity worst_of(const Findings& findings);

// "(0.110, 0.000, -0.001)", with so many decimals.
std::string format_vector(const Eigen::Vector3d& vector, int decimals = 3);

// Collects findings of one topic.
class Topic {
 public:
  Topic(std::string name, Findings& findings) : name_(std::move(name)), findings_(findings) {}

  // The advice is for severities other than kOk.
  void add(Severity severity, const std::string& name, const std::string& text,
           const std::string& advice, std::optional<double> value = std::nullopt);
  void ok(const std::string& name, const std::string& text,
          std::optional<double> value = std::nullopt) {
    add(Severity::kOk, name, text, "", value);
  }

 private:
  std::string name_;
  Findings& findings_;
};

// Warning above `bad`, note above `doubtful`, else ok.
inline Severity judge_above(double value, double doubtful, double bad) {
  return value > bad ? Severity::kWarning : value > doubtful ? Severity::kNote : Severity::kOk;
}

}  // namespace rover
