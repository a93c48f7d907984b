#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rover/evaluation/report.h"
#include "rover/evaluation/run_folder.h"

namespace rover {

// What a report is made of.
struct RunReport {
  std::string title;  // the sequence
  const RunFolder& run;
  // Of the final trajectory first, then the causal one and those of others; none without ground
  // truth. Estimates belong to the judgements, one each.
  const std::vector<Judgement>& judgements;
  const std::vector<Trajectory>& estimates;
  const Trajectory& reference;  // in the time of the estimates
  ReportOptions options;
  std::filesystem::path map;  // map.ply; may be absent
};

// One HTML file that needs no other: the verdict and the figures, the trajectory over the ground
// truth, errors, features and matches over time, times of the stages, memory, sample frames, the
// map, and the configuration.
std::string run_report_html(const RunReport& report);

}  // namespace rover
