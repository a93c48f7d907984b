#pragma once

#include <string>
#include <vector>

#include "rover/evaluation/judgement.h"

namespace rover {

// Which alignments a table shows; the relative errors are those of the first.
struct ReportOptions {
  bool rigid = true;
  bool similarity = true;
  bool gravity = false;
  AlignmentKind headline = AlignmentKind::kRigid;
};

// SE(3), Sim(3), 4-DoF.
const char* name_of(AlignmentKind kind);

// One column per trajectory, one row per figure; the first row holds the names.
std::vector<std::vector<std::string>> table_rows(const std::vector<Judgement>& judgements,
                                                 const ReportOptions& options);
// The same as text with aligned columns.
std::string format_table(const std::vector<Judgement>& judgements, const ReportOptions& options);

// The errors under one alignment, if it is determined.
const std::optional<AlignedErrors>& errors_under(const Judgement& judgement, AlignmentKind kind);

}  // namespace rover
