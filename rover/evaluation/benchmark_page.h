#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rover/evaluation/benchmark_results.h"

namespace rover {

// A page with all cells side by side: ATE, then for each sequence and mode the figures, a small
// drawing of each configuration's first trajectory, times of the stages, and links to the reports
// of the runs. `folder` is the benchmark's, in which the page is to lie. Runs without
// evaluation.json have no drawing.
std::string benchmark_page(const std::string& title, const std::filesystem::path& folder,
                           const std::vector<BenchmarkRun>& runs);

}  // namespace rover
