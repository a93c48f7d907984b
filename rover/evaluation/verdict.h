#pragma once

#include <string>
#include <vector>

#include "rover/evaluation/report.h"
#include "rover/evaluation/run_folder.h"

namespace rover {

// What came out of a run, in plain words: how much of it was tracked, how far off it is (if it was
// judged: the first judgement is that of the final trajectory), how fast it was. One sentence or
// two each.
std::vector<std::string> verdict(const RunFolder& run, const std::vector<Judgement>& judgements,
                                 const ReportOptions& options);

// A length in mm, cm or m.
std::string length_words(double metres);

}  // namespace rover
