#include "rover/evaluation/report.h"

#include <algorithm>
#include <functional>

#include <fmt/format.h>

#include "rover/evaluation/text_table.h"

namespace rover {
namespace {

using Cell = std::function<std::string(const Judgement&)>;

class Table {
 public:
  explicit Table(const std::vector<Judgement>& judgements) : judgements_(judgements) {
    add("", [](const Judgement& j) { return j.name; });
  }

  void add(const std::string& label, const Cell& cell) {
    rows_.push_back({label});
    for (const Judgement& judgement : judgements_) rows_.back().push_back(cell(judgement));
  }

  const std::vector<std::vector<std::string>>& rows() const { return rows_; }

 private:
  const std::vector<Judgement>& judgements_;
  std::vector<std::vector<std::string>> rows_;
};

void add_errors(Table& table, AlignmentKind kind, const std::string& label,
                const std::function<std::string(const AlignedErrors&)>& cell) {
  table.add(label, [kind, cell](const Judgement& judgement) {
    const auto& errors = errors_under(judgement, kind);
    return errors ? cell(*errors) : std::string("-");
  });
}

// Shown only where there is one to be told.
void add_drift(Table& table, AlignmentKind kind) {
  add_errors(table, kind, "  drift, aligned at the start: end [m]", [](const AlignedErrors& e) {
    return e.drift ? fmt::format("{:.4f}", e.drift->position.rmse) : std::string("-");
  });
  add_errors(table, kind, "  drift [% of the path]", [](const AlignedErrors& e) {
    return e.drift ? fmt::format("{:.3f}", e.drift->percent) : std::string("-");
  });
}

void add_alignment(Table& table, const std::vector<Judgement>& judgements, AlignmentKind kind) {
  const std::string name = name_of(kind);
  add_errors(table, kind, "ATE " + name + ", rmse [m]",
             [](const AlignedErrors& e) { return fmt::format("{:.4f}", e.position.rmse); });
  add_errors(table, kind, "  mean, median [m]", [](const AlignedErrors& e) {
    return fmt::format("{:.4f}, {:.4f}", e.position.mean, e.position.median);
  });
  add_errors(table, kind, "  max, std [m]", [](const AlignedErrors& e) {
    return fmt::format("{:.4f}, {:.4f}", e.position.max, e.position.std);
  });
  const auto has_drift = [&](const Judgement& j) {
    const auto& errors = errors_under(j, kind);
    return errors && errors->drift;
  };
  if (std::any_of(judgements.begin(), judgements.end(), has_drift)) add_drift(table, kind);
  if (kind != AlignmentKind::kSimilarity) return;
  add_errors(table, kind, "  scale", [](const AlignedErrors& e) {
    return fmt::format("{:.4f}", e.reference_from_estimate.scale);
  });
}

void add_relative(Table& table, AlignmentKind kind) {
  add_errors(table, kind, fmt::format("RPE {} per frame, rmse [mm]", name_of(kind)),
             [](const AlignedErrors& e) {
               return fmt::format("{:.2f}", 1000 * e.relative_translation.rmse);
             });
  add_errors(table, kind, "  rotation, rmse [deg]", [](const AlignedErrors& e) {
    return fmt::format("{:.4f}", e.relative_rotation.rmse);
  });
  add_errors(table, kind, "RPE per distance [%]", [](const AlignedErrors& e) {
    return e.per_distance.count > 0 ? fmt::format("{:.3f}", e.per_distance.translation) : "-";
  });
  add_errors(table, kind, "  rotation [deg/m]", [](const AlignedErrors& e) {
    return e.per_distance.count > 0 ? fmt::format("{:.5f}", e.per_distance.rotation) : "-";
  });
  add_errors(table, kind, "  over stretches of [m]", [](const AlignedErrors& e) {
    const auto& lengths = e.per_distance.lengths;
    if (lengths.empty()) return std::string("-");
    return fmt::format("{:.3g} to {:.3g}", lengths.front(), lengths.back());
  });
}

}  // namespace

const char* name_of(AlignmentKind kind) {
  switch (kind) {
    case AlignmentKind::kRigid:
      return "SE(3)";
    case AlignmentKind::kSimilarity:
      return "Sim(3)";
    case AlignmentKind::kUpright:
      return "4-DoF";
  }
  return "";
}

const std::optional<AlignedErrors>& errors_under(const Judgement& judgement, AlignmentKind kind) {
  if (kind == AlignmentKind::kSimilarity) return judgement.similarity;
  return kind == AlignmentKind::kUpright ? judgement.gravity : judgement.rigid;
}

std::vector<std::vector<std::string>> table_rows(const std::vector<Judgement>& judgements,
                                                 const ReportOptions& options) {
  Table table(judgements);
  table.add("poses", [](const Judgement& j) { return fmt::format("{}", j.poses); });
  table.add("  with a reference",
            [](const Judgement& j) { return fmt::format("{}", j.associated); });
  table.add("coverage [%]", [](const Judgement& j) {
    return j.coverage ? fmt::format("{:.1f}", 100 * *j.coverage) : "-";
  });
  table.add("longest gap [s]",
            [](const Judgement& j) { return fmt::format("{:.3f}", j.longest_gap); });
  table.add("path [m]", [](const Judgement& j) { return fmt::format("{:.2f}", j.path); });
  if (options.rigid) add_alignment(table, judgements, AlignmentKind::kRigid);
  if (options.similarity) add_alignment(table, judgements, AlignmentKind::kSimilarity);
  if (options.gravity) add_alignment(table, judgements, AlignmentKind::kUpright);
  add_relative(table, options.headline);
  return table.rows();
}

std::string format_table(const std::vector<Judgement>& judgements, const ReportOptions& options) {
  return format_rows(table_rows(judgements, options));
}

}  // namespace rover
